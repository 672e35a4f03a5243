// A motion as binary glTF, for Blender and any viewer: one node per link, one second per ten waypoints; for each
// waypoint with findings a node of its forces, of size 0 at other times.
import { InterpolateDiscrete, AnimationClip, BufferAttribute, BufferGeometry, Group, Matrix4, Mesh as Drawn, MeshStandardMaterial, Quaternion, QuaternionKeyframeTrack, Vector3, VectorKeyframeTrack } from 'three';
import { GLTFExporter } from 'three/examples/jsm/exporters/GLTFExporter.js';
import type { Dataset, Findings, Mesh } from './data';
import { drawForces, floorOf } from './forces';
import { LinkTree } from './motion';

const SECONDS = 0.1;

/** A track that shows a group from the time of its waypoint to that of the next one. */
function shownAt(group: Group, waypoint: number, times: number[]): VectorKeyframeTrack {
  const keys: [number, number][] = waypoint > 0 ? [[times[0], 0], [times[waypoint], 1]] : [[times[0], 1]];
  if (waypoint + 1 < times.length) keys.push([times[waypoint + 1], 0]);
  return new VectorKeyframeTrack(`${group.uuid}.scale`, keys.map(([time]) => time), keys.flatMap(([, size]) => [size, size, size]), InterpolateDiscrete);
}

export async function exportMotion(dataset: Dataset, meshes: Mesh[], x: Float64Array[], stamps?: number[], findings?: Findings[]): Promise<ArrayBuffer> {
  const root = new Group(), tree = new LinkTree(dataset.robot);
  const up = new Matrix4().makeRotationX(-Math.PI / 2);  // z up becomes glTF's y up
  root.name = dataset.robot.name;
  root.applyMatrix4(up);
  const material = new MeshStandardMaterial({ color: 0xd8dade, roughness: 0.6 }), ground = new MeshStandardMaterial({ color: 0x9a9fa8, roughness: 1 });
  const add = (index: number, to: Group, with_: MeshStandardMaterial) => {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(meshes[index].positions, 3));
    geometry.setIndex(new BufferAttribute(meshes[index].indices, 1));
    geometry.computeVertexNormals();
    to.add(new Drawn(geometry, with_));
  };
  const links = dataset.robot.links.map((link) => {
    const group = new Group();
    group.name = link.name;
    link.meshes.forEach((mesh) => add(mesh, group, material));
    root.add(group);
    return group;
  });
  const scene = new Group();
  scene.name = 'scene';
  dataset.scene.objects.forEach((object) => add(object.mesh, scene, ground));
  root.add(scene);
  const positions = links.map(() => [] as number[]), turns = links.map(() => [] as number[]);
  const p = new Vector3(), q = new Quaternion(), scale = new Vector3();
  const forces: { group: Group; waypoint: number }[] = [];
  for (const [w, waypoint] of x.entries()) {
    const poses = tree.update(waypoint), found = findings?.[w];
    if (found?.holding) {
      const group = drawForces(dataset, poses, found.holding, found, floorOf(dataset, poses, found));
      if (x.length > 1) group.name = `forces at waypoint ${w}`;
      root.add(group);
      forces.push({ group, waypoint: w });
    }
    poses.forEach((pose, i) => {
      pose.decompose(p, q, scale);
      positions[i].push(p.x, p.y, p.z);
      turns[i].push(q.x, q.y, q.z, q.w);
    });
  }
  links.forEach((link, i) => {
    link.position.fromArray(positions[i]);
    link.quaternion.fromArray(turns[i]);
  });
  const times = x.map((_, w) => (stamps?.[w] ?? w) * SECONDS);
  const tracks = links.flatMap((link, i) => [
    new VectorKeyframeTrack(`${link.uuid}.position`, times, positions[i]), new QuaternionKeyframeTrack(`${link.uuid}.quaternion`, times, turns[i])]);
  const shown = forces.map(({ group, waypoint }) => shownAt(group, waypoint, times));
  const animations = x.length > 1 ? [new AnimationClip('motion', -1, [...tracks, ...shown])] : [];
  return (await new GLTFExporter().parseAsync(root, { binary: true, animations })) as ArrayBuffer;
}
