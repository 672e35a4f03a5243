// The 3D view: scene, robot, a second solution as ghost, and the judge's findings.
import {
  AmbientLight, BufferAttribute, BufferGeometry, Color, DirectionalLight, DoubleSide, EdgesGeometry, Group, HemisphereLight, Line, LineBasicMaterial,
  LineLoop, LineSegments, Mesh as Drawn, MeshBasicMaterial, MeshStandardMaterial, PerspectiveCamera, Scene, SphereGeometry, Vector3, WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';
import type { Dataset, Findings, Holding, Mesh, Overlap } from './data';
import { POLYGON, drawForces, floorOf, metresPerNewton } from './forces';
import { LinkTree, poseMatrix } from './motion';
import { isDark } from './marks';

export interface Layers { convex: boolean; scene: boolean; findings: boolean; steps: boolean; follow: boolean; forces: boolean }

const TURN = Math.PI / 24, STEEPEST = 1.5, ZOOM = 1.15, MOVE = 0.05;  // effect of one key press; radians, factors

const ATTEMPT = 0xcc79a7;  // the robot in a window that was not solved
const RED = 0xd55e00, BLUE = 0x0072b2, GREEN = 0x009e73, SKY = 0x56b4e9, YELLOW = 0xe6b800;

const vector = (p: number[]) => new Vector3(p[0], p[1], p[2]);

function geometryOf(mesh: Mesh): BufferGeometry {
  const shared = new BufferGeometry();
  shared.setAttribute('position', new BufferAttribute(mesh.positions, 3));
  shared.setIndex(new BufferAttribute(mesh.indices, 1));
  const flat = shared.toNonIndexed();
  flat.computeVertexNormals();
  return flat;
}

export class View {
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(40, 1, 0.02, 500);
  private readonly controls: OrbitControls;
  private readonly links: { group: Group; exact: Drawn[]; convex: Drawn[] }[] = [];
  private readonly ghosts: Group[] = [];
  private readonly sceneExact = new Group();
  private readonly sceneConvex = new Group();
  private readonly found = new Group();
  private readonly forces = new Group();
  private readonly targets = new Group();
  private readonly tree: LinkTree;
  private readonly ghostTree: LinkTree;
  private focus = new Vector3();
  private readonly disposables: { dispose(): void }[] = [];
  layers: Layers = { convex: false, scene: true, findings: true, steps: true, follow: false, forces: false };
  onZoom: () => void = () => undefined;  // called after the scale of the picture changed

  /** Throws if the browser has no WebGL. */
  constructor(private readonly canvas: HTMLCanvasElement, private readonly dataset: Dataset, private readonly meshes: Mesh[]) {
    this.renderer = new WebGLRenderer({ canvas, antialias: true, preserveDrawingBuffer: true });
    this.tree = new LinkTree(dataset.robot);
    this.ghostTree = new LinkTree(dataset.robot);
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => { this.render(); this.onZoom(); });
    const sun = new DirectionalLight(0xffffff, 1.6), back = new DirectionalLight(0xffffff, 0.5);
    sun.position.set(4, -3, 8);
    back.position.set(-5, 4, 2);
    this.scene.add(new AmbientLight(0xffffff, 0.5), new HemisphereLight(0xffffff, 0x888888, 0.7), sun, back);
    this.addScene();
    this.addRobot();
    this.scene.add(this.sceneExact, this.sceneConvex, this.found, this.forces, this.targets);
    this.paint();
  }

  private keep<T extends { dispose(): void }>(thing: T): T {
    this.disposables.push(thing);
    return thing;
  }

  private addScene(): void {
    const material = this.keep(new MeshStandardMaterial({ color: isDark() ? 0x6d737c : 0xb9bdc4, roughness: 0.95, side: DoubleSide }));
    for (const object of this.dataset.scene.objects) {
      this.sceneExact.add(new Drawn(this.keep(geometryOf(this.meshes[object.mesh])), material));
    }
    if (this.dataset.scene.convex === null) return;
    const pieces = geometryOf(this.meshes[this.dataset.scene.convex]);
    this.sceneConvex.add(new Drawn(this.keep(pieces), this.keep(new MeshStandardMaterial({ color: 0x9fb7c9, roughness: 1, transparent: true, opacity: 0.55, side: DoubleSide }))));
    this.sceneConvex.add(new LineSegments(this.keep(new EdgesGeometry(pieces, 20)), this.keep(new LineBasicMaterial({ color: BLUE }))));
  }

  private addRobot(): void {
    const ghost = this.keep(new MeshStandardMaterial({ color: SKY, transparent: true, opacity: 0.3, depthWrite: false }));
    for (const link of this.dataset.robot.links) {
      const group = new Group(), phantom = new Group(), exact: Drawn[] = [], convex: Drawn[] = [];
      group.matrixAutoUpdate = phantom.matrixAutoUpdate = false;
      for (const index of link.meshes) {
        const geometry = this.keep(geometryOf(this.meshes[index]));
        const drawn = new Drawn(geometry, this.keep(new MeshStandardMaterial({ color: 0xe4e6ea, roughness: 0.6, metalness: 0.1 })));
        exact.push(drawn);
        phantom.add(new Drawn(geometry, ghost));
      }
      if (link.convex !== null) {
        convex.push(new Drawn(this.keep(geometryOf(this.meshes[link.convex])), this.keep(new MeshStandardMaterial({ color: 0x9fb7c9, roughness: 0.8 }))));
      }
      [...exact, ...convex].forEach((mesh) => group.add(mesh));
      phantom.visible = false;
      this.scene.add(group, phantom);
      this.links.push({ group, exact, convex });
      this.ghosts.push(phantom);
    }
  }

  paint(): void {
    this.scene.background = new Color(isDark() ? 0x1d2025 : 0xf4f5f7);
    this.render();
  }

  resize(width: number, height: number): void {
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.render();
    this.onZoom();
  }

  apply(): void {
    this.sceneExact.visible = this.layers.scene && !(this.layers.convex && this.dataset.scene.convex !== null);
    this.sceneConvex.visible = this.layers.scene && this.layers.convex;
    this.found.visible = this.layers.findings;
    this.targets.visible = this.layers.steps;
    this.forces.visible = this.layers.forces;
    for (const link of this.links) {
      const pieces = this.layers.convex && link.convex.length > 0;
      link.exact.forEach((mesh) => { mesh.visible = !pieces; });
      link.convex.forEach((mesh) => { mesh.visible = pieces; });
    }
    this.render();
  }

  show(x: Float64Array | null, ghost: Float64Array | null): void {
    this.links.forEach((link) => { link.group.visible = x !== null; });
    if (x) {
      const poses = this.tree.update(x);
      this.links.forEach((link, i) => link.group.matrix.copy(poses[i]));
      const base = new Vector3().setFromMatrixPosition(poses[0]);
      if (this.layers.follow) {
        this.camera.position.add(base).sub(this.focus);
        this.controls.target.add(base).sub(this.focus);
      }
      this.focus = base;
    }
    this.ghosts.forEach((group) => { group.visible = ghost !== null; });
    if (ghost) {
      const poses = this.ghostTree.update(ghost);
      this.ghosts.forEach((group, i) => group.matrix.copy(poses[i]));
    }
  }

  /** Points the camera at the robot, or at the given point from near. */
  look(at?: number[]): void {
    const point = at ? vector(at) : this.focus.clone();
    const direction = this.camera.position.distanceTo(this.controls.target) > 0.5 && at
      ? this.camera.position.clone().sub(this.controls.target).normalize() : new Vector3(0.75, -0.85, 0.35).normalize();
    this.controls.target.copy(point);
    this.camera.position.copy(point).addScaledVector(direction, at ? 1.5 : 3.4);
    this.controls.update();
    this.render();
  }

  /** Index of the link of this name, or of the contact's or joint's link; -1 if there is none. */
  private linkOf(name: string): number {
    const { links, feet, joints } = this.dataset.robot, link = links.findIndex((one) => one.name === name);
    return link >= 0 ? link : feet.find((foot) => foot.name === name)?.link ?? joints.find((joint) => joint.name === name)?.child ?? -1;
  }

  /** Points the camera at the origin of a link, given by its index or the name of a link, contact or joint. */
  lookAtLink(link: number | string): void {
    const index = typeof link === 'number' ? link : this.linkOf(link);
    if (index >= 0 && this.tree.poses[index]) this.look(new Vector3().setFromMatrixPosition(this.tree.poses[index]).toArray());
  }

  /** Applies a key to the camera; returns false for keys without effect. */
  press({ key, shiftKey, ctrlKey, altKey, metaKey }: KeyboardEvent): boolean {
    if (ctrlKey || altKey || metaKey) return false;
    const way: Record<string, [number, number]> = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
    if (key in way && shiftKey) this.move(...way[key]);
    else if (key in way) this.turn(...way[key]);
    else if (key === '+' || key === '=') this.zoom(1 / ZOOM);
    else if (key === '-' || key === '_') this.zoom(ZOOM);
    else if (key === 'Home') this.look();
    else return false;
    return true;
  }

  /** Rotates around the target: by TURN to the right, and upwards. */
  private turn(right: number, up: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target), radius = offset.length();
    const azimuth = Math.atan2(offset.y, offset.x) + right * TURN;
    const elevation = Math.max(-STEEPEST, Math.min(STEEPEST, Math.asin(offset.z / radius) + up * TURN));
    this.placeCamera(new Vector3(Math.cos(elevation) * Math.cos(azimuth), Math.cos(elevation) * Math.sin(azimuth), Math.sin(elevation)).multiplyScalar(radius));
  }

  private zoom(factor: number): void {
    this.placeCamera(this.camera.position.clone().sub(this.controls.target).multiplyScalar(factor));
  }

  /** Moves camera and target in the plane of the picture. */
  private move(right: number, up: number): void {
    const offset = this.camera.position.clone().sub(this.controls.target), step = MOVE * offset.length();
    this.controls.target.addScaledVector(new Vector3().setFromMatrixColumn(this.camera.matrix, 0), right * step)
      .addScaledVector(new Vector3().setFromMatrixColumn(this.camera.matrix, 1), up * step);
    this.placeCamera(offset);
  }

  private placeCamera(offset: Vector3): void {
    this.camera.position.copy(this.controls.target).add(offset);
    this.controls.update();
    this.render();
  }

  /** Position and target of the camera, for tests. */
  cameraState(): number[] { return [...this.camera.position.toArray(), ...this.controls.target.toArray()]; }

  /** Without a robot: looks at the mean of the contacts. */
  lookAtFeet(feet: { target: number[] }[]): void {
    if (feet.length === 0) return;
    this.focus = feet.reduce((sum, foot) => sum.add(vector(foot.target)), new Vector3()).divideScalar(feet.length);
    this.look();
  }

  private lineOf(points: Vector3[], colour: number, closed = false): Line {
    const geometry = new BufferGeometry().setFromPoints(points);
    const material = new LineBasicMaterial({ color: colour, depthTest: false, transparent: true });
    const drawn = closed ? new LineLoop(geometry, material) : new Line(geometry, material);
    drawn.renderOrder = 2;
    return drawn;
  }

  private ball(at: Vector3, colour: number, radius: number): Drawn {
    const drawn = new Drawn(new SphereGeometry(radius, 16, 12), new MeshBasicMaterial({ color: colour, depthTest: false, transparent: true }));
    drawn.position.copy(at);
    drawn.renderOrder = 3;
    return drawn;
  }

  private clear(group: Group): void {
    group.traverse((child) => {
      const drawn = child as Partial<Drawn>;
      drawn.geometry?.dispose();
      (drawn.material as MeshBasicMaterial | undefined)?.dispose();
    });
    group.clear();
  }

  /** Draws contacts: those of the current stance green, all others of the problem faint. */
  drawTargets(stances: Dataset['problems'][string][string], present: number): void {
    this.clear(this.targets);
    const contacts = new Map(this.dataset.robot.feet.map((foot) => [foot.name, foot]));
    stances.forEach((stance, s) => {
      if (s !== present && Math.abs(s - present) > 12) return;
      for (const foot of stance.feet) {
        const contact = contacts.get(foot.contact);
        if (!contact) continue;
        const pose = poseMatrix(foot.target);
        const corners = contact.outline.map((point) => vector(point).applyMatrix4(pose));
        const loop = this.lineOf(corners, s === present ? GREEN : 0x8a8f98, true);
        if (s !== present) (loop.material as LineBasicMaterial).opacity = 0.35;
        this.targets.add(loop);
      }
    });
  }

  /** `attempt`: the robot is at the best point of an unsolved window. */
  drawFindings(findings: Findings | null, overlaps: Overlap[], collides: (o: Overlap) => boolean, x: Float64Array | null, attempt: boolean): void {
    this.clear(this.found);
    const paintLink = (index: number, colour: number) => this.links[index]?.exact.concat(this.links[index].convex)
      .forEach((mesh) => (mesh.material as MeshStandardMaterial).color.set(colour));
    this.links.forEach((link) => {
      link.exact.forEach((mesh) => (mesh.material as MeshStandardMaterial).color.set(attempt ? ATTEMPT : 0xe4e6ea));
      link.convex.forEach((mesh) => (mesh.material as MeshStandardMaterial).color.set(attempt ? ATTEMPT : 0x9fb7c9));
    });
    for (const overlap of overlaps) {
      const failed = collides(overlap);
      if (failed) {
        paintLink(overlap.link, RED);
        if (overlap.other !== undefined) paintLink(overlap.other, YELLOW);
      }
      if (!overlap.points || (overlap.fails && !failed)) continue;
      const [a, b] = overlap.points.map(vector);
      this.found.add(this.lineOf([a, b], failed ? RED : 0x8a8f98));
      if (failed) this.found.add(this.ball(a, RED, 0.006), this.ball(b, YELLOW, 0.006));
    }
    if (findings) this.drawBalance(findings);
    if (x && findings) {
      for (const limit of findings.limits) {
        const at = new Vector3().setFromMatrixPosition(this.tree.poses[limit.link]);
        this.found.add(this.ball(at, limit.violated ? RED : SKY, limit.violated ? 0.03 : 0.014));
      }
      for (const foot of findings.feet.filter((f) => f.violated)) {
        const index = this.linkOf(foot.link);
        if (index >= 0) paintLink(index, RED);
      }
    }
  }

  /** Draws contact forces, friction cones, torques, and how the robot falls if it is not held. `findings`: of a posture; a motion has none. */
  drawForces(holding: Holding | undefined, findings: Findings | null): void {
    this.clear(this.forces);
    const floor = findings ? floorOf(this.dataset, this.tree.poses, findings) : 0;
    if (holding) this.forces.add(drawForces(this.dataset, this.tree.poses, holding, findings, floor));
  }

  /** Length of the arrow of one newton at the point that the camera turns about, in pixels of the page. */
  pixelsPerNewton(): number {
    const height = 2 * Math.tan((this.camera.fov * Math.PI) / 360) * this.camera.position.distanceTo(this.controls.target);
    return height > 0 ? (metresPerNewton(this.dataset) * this.canvas.clientHeight) / height : 0;
  }

  /** Names of the drawn forces, cones, bars and movements, for tests. */
  drawnForces(): string[] {
    const names: string[] = [];
    if (this.forces.visible) this.forces.traverse(({ name }) => { if (name) names.push(name); });
    return names;
  }

  private drawBalance(findings: Findings): void {
    const com = vector(findings.com), colour = findings.com_violated ? RED : GREEN, floor = floorOf(this.dataset, this.tree.poses, findings);
    const isSupport = findings.holding?.polygon !== undefined || !findings.holding;  // else the equilibrium polygon
    const drop = new Vector3(com.x, com.y, floor);
    this.found.add(this.ball(com, colour, 0.022), this.ball(drop, colour, 0.012), this.lineOf([com, drop], colour));
    if (findings.polygon.length > 0) {
      this.found.add(this.lineOf(findings.polygon.map(([x, y]) => new Vector3(x, y, floor)), isSupport ? BLUE : POLYGON, findings.polygon.length > 2));
    }
  }

  render(): void { this.renderer.render(this.scene, this.camera); }

  /** Fraction of the canvas' pixels that are not background, for tests. */
  filled(): number {
    const gl = this.renderer.getContext(), { width, height } = this.canvas, pixels = new Uint8Array(4 * width * height);
    this.render();
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    let other = 0;
    for (let i = 0; i < pixels.length; i += 4) {
      if (Math.abs(pixels[i] - pixels[0]) + Math.abs(pixels[i + 1] - pixels[1]) + Math.abs(pixels[i + 2] - pixels[2]) > 12) ++other;
    }
    return other / (width * height);
  }

  dispose(): void {
    this.clear(this.found);
    this.clear(this.targets);
    this.clear(this.forces);
    this.disposables.forEach((thing) => thing.dispose());
    this.controls.dispose();
    this.renderer.dispose();
  }
}
