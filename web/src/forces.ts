// Contact forces, friction cones, the equilibrium polygon and joint torques as drawings in the world, for the view and
// for glTF. All figures are the judge's.
import {
  BufferGeometry, Color, ConeGeometry, CylinderGeometry, DoubleSide, FrontSide, Group, Line, LineLoop, Matrix4, Mesh as Drawn, MeshBasicMaterial,
  Quaternion, Shape, ShapeGeometry, SphereGeometry, Vector3,
} from 'three';
import type { ContactHolding, Dataset, Findings, Holding } from './data';

const FORCE = 0x0072b2, AT_EDGE = 0xcc79a7, CONE = 0x56b4e9, FAILED = 0xd55e00, TRACK = 0x8a8f98;
export const POLYGON = 0xa8588a;
const LOW = new Color(0x009e73), MIDDLE = new Color(0xe6b800), HIGH = new Color(FAILED);
const MIDDLE_SHARE = 0.6;

// Lengths as shares of the robot's size.
const WEIGHT = 0.38, LEAST_ARROW = 0.004, SHAFT = 0.0035, TRACK_LENGTH = 0.1, BAR = 0.005, MOVEMENT = 0.14;

const LEAST_BAR = 0.05;  // smallest drawn share of a torque limit

/** Share of the friction cone from which a force counts as at its edge: the pyramid's faces are at 0.924. */
export const EDGE_SHARE = 0.92;

const vector = (p: number[]) => new Vector3(p[0], p[1], p[2]);

/** Diagonal of the box around all link frames, m. */
export function sizeOf(dataset: Dataset): number {
  const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (const pose of dataset.check.poses) for (let i = 0; i < 3; ++i) { low[i] = Math.min(low[i], pose[i]); high[i] = Math.max(high[i], pose[i]); }
  return Math.max(0.1, Math.hypot(...high.map((value, i) => value - low[i])));
}

/** Length of an arrow per newton, m. */
export const metresPerNewton = (dataset: Dataset): number => (WEIGHT * sizeOf(dataset)) / (dataset.robot.weight_N ?? 1000);

/** Sum of a contact's forces. */
export function totalOf(contact: ContactHolding): { normal_N: number; tangential_N: number; share: number | null } {
  const normal = vector(contact.normal), sum = new Vector3();
  contact.forces.forEach(({ force_N }) => sum.add(vector(force_N)));
  const normal_N = sum.dot(normal), tangential_N = sum.addScaledVector(normal, -normal_N).length();
  return { normal_N, tangential_N, share: contact.friction === null || !(normal_N > 0) ? null : tangential_N / (contact.friction * normal_N) };
}

/** Largest |torque| / limit first; joints without a limit are left out. */
export function loadedJoints(dataset: Dataset, holding: Holding): { dof: number; joint: string; link: number; torque: number; limit: number; share: number }[] {
  return (holding.torques ?? []).flatMap((torque, dof) => {
    const limit = dataset.robot.efforts?.[dof] ?? null, joint = jointOf(dataset, dof);
    return torque === null || limit === null || !joint ? [] : [{ dof, joint: joint.name, link: joint.child, torque, limit, share: Math.abs(torque) / limit }];
  }).sort((a, b) => b.share - a.share);
}

/** The joint of a degree of freedom; of several, the one that leads. */
export const jointOf = (dataset: Dataset, dof: number) =>
  dataset.robot.joints.find((joint) => joint.dof === dof && joint.multiplier === 1) ?? dataset.robot.joints.find((joint) => joint.dof === dof);

/** Green for a small share of a limit, orange from the limit on. */
export function colourOfShare(share: number): Color {
  return share < MIDDLE_SHARE ? LOW.clone().lerp(MIDDLE, share / MIDDLE_SHARE) : MIDDLE.clone().lerp(HIGH, Math.min(1, (share - MIDDLE_SHARE) / (1 - MIDDLE_SHARE)));
}

function solid(geometry: BufferGeometry, colour: number | Color, order: number, opacity = 1): Drawn {
  const drawn = new Drawn(geometry, new MeshBasicMaterial({ color: colour, transparent: true, opacity, depthTest: false, depthWrite: false, side: opacity < 1 ? DoubleSide : FrontSide }));
  drawn.renderOrder = order;
  return drawn;
}

/** Places a drawing made along +y at a point, along a direction. */
function place<T extends Drawn | Group>(drawn: T, at: Vector3, along: Vector3): T {
  drawn.quaternion.copy(new Quaternion().setFromUnitVectors(new Vector3(0, 1, 0), along.clone().normalize()));
  drawn.position.copy(at);
  return drawn;
}

function arrow(name: string, at: Vector3, along: Vector3, colour: number, radius: number): Group {
  const length = along.length(), head = Math.min(0.45 * length, 7 * radius), made = new Group();
  made.add(solid(new CylinderGeometry(radius, radius, length - head, 10).translate(0, (length - head) / 2, 0), colour, 6));
  made.add(solid(new ConeGeometry(Math.min(2.6 * radius, 0.5 * head), head, 14).translate(0, length - head / 2, 0), colour, 6));
  made.name = name;
  return place(made, at, along);
}

/** The cone of forces at a point, as high as the normal force, so that the arrow ends on its base. */
function frictionCone(name: string, at: Vector3, normal: Vector3, friction: number, height: number, atEdge: boolean): Drawn {
  const cone = solid(new ConeGeometry(friction * height, height, 32, 1, true).rotateX(Math.PI).translate(0, height / 2, 0), atEdge ? AT_EDGE : CONE, 4, 0.22);
  cone.name = name;
  return place(cone, at, normal);
}

function addContact(contact: ContactHolding, scale: number, size: number, forces: Group, cones: Group): void {
  const normal = vector(contact.normal);
  contact.forces.forEach(({ at, force_N }, k) => {
    const force = vector(force_N), along = force.clone().multiplyScalar(scale), normal_N = force.dot(normal), name = `${contact.contact} ${k}`;
    const share = contact.friction === null ? 0 : force.clone().addScaledVector(normal, -normal_N).length() / (contact.friction * normal_N);
    if (along.length() > LEAST_ARROW * size) forces.add(arrow(`force ${name}: ${force.length().toFixed(0)} N`, vector(at), along, share > EDGE_SHARE ? AT_EDGE : FORCE, SHAFT * size));
    if (contact.friction !== null && normal_N * scale > LEAST_ARROW * size) {
      cones.add(frictionCone(`friction cone ${name}`, vector(at), normal, contact.friction, normal_N * scale, share > EDGE_SHARE));
    }
  });
}

/** How the robot falls: arrows at contacts that slip or yield, and at the centre of mass. */
function collapse(holding: Holding, com: number[], size: number): Group {
  const made = new Group();
  made.name = 'collapse';
  const add = (name: string, at: number[], direction: number[], length: number) => made.add(arrow(name, vector(at), vector(direction).multiplyScalar(length), FAILED, 1.6 * SHAFT * size));
  for (const { contact, collapse: moves } of holding.contacts) {
    if (!moves?.direction || moves.movement === 'lifts') continue;
    add(`${contact} ${moves.movement}`, moves.at, moves.direction, MOVEMENT * size);
  }
  if (holding.com_direction) add('fall of the centre of mass', com, holding.com_direction, MOVEMENT * size);
  return made;
}

/** A bar along each joint's axis: its torque as a share of the limit, to which the track reaches on either side. */
function torqueBars(dataset: Dataset, poses: Matrix4[], holding: Holding, size: number): Group {
  const made = new Group(), half = 0.5 * TRACK_LENGTH * size, radius = BAR * size;
  made.name = 'joint torques';
  for (const { dof, joint, link, torque, share } of loadedJoints(dataset, holding).filter((one) => one.share >= LEAST_BAR)) {
    const overloaded = holding.overloaded?.includes(dof), at = new Vector3().setFromMatrixPosition(poses[link]);
    const axis = vector(jointOf(dataset, dof)!.axis).transformDirection(poses[link]);
    made.add(place(solid(new CylinderGeometry(0.25 * radius, 0.25 * radius, 2 * half, 8), TRACK, 4, 0.6), at, axis));
    for (const end of [-half, half]) made.add(place(solid(new CylinderGeometry(0.8 * radius, 0.8 * radius, 0.25 * radius, 12).translate(0, end, 0), TRACK, 4, 0.6), at, axis));
    const length = Math.min(1.5, share) * half;
    const bar = solid(new CylinderGeometry(radius, radius, length, 12).translate(0, length / 2, 0), colourOfShare(share), overloaded ? 7 : 5);
    bar.name = `${joint}: ${(100 * share).toFixed(0)} % of the limit`;
    made.add(place(bar, at, torque < 0 ? axis.clone().negate() : axis));
    if (!overloaded) continue;
    const halo = solid(new SphereGeometry(0.5 * half, 20, 14), FAILED, 5, 0.3);
    halo.name = `${joint} is overloaded`;
    halo.position.copy(at);
    made.add(halo);
  }
  return made;
}

/** The equilibrium polygon as a translucent surface with an outline. */
function polygonAt(corners: [number, number][], height: number): Group {
  const made = new Group();
  made.name = 'equilibrium polygon';
  if (corners.length > 2) {
    const surface = solid(new ShapeGeometry(new Shape(corners.map(([x, y]) => ({ x, y }) as never))), POLYGON, 1, 0.25);
    surface.position.z = height;
    made.add(surface);
  }
  if (corners.length > 1) {
    const geometry = new BufferGeometry().setFromPoints(corners.map(([x, y]) => new Vector3(x, y, height)));
    const material = new MeshBasicMaterial({ color: POLYGON, depthTest: false, transparent: true });  // glTF has no material of lines
    const outline = corners.length > 2 ? new LineLoop(geometry, material) : new Line(geometry, material);
    outline.renderOrder = 2;
    made.add(outline);
  }
  return made;
}

/** Forces and torques. `findings`: of the posture, for its polygon and its fall; `floor`: height at which polygons are drawn. */
export function drawForces(dataset: Dataset, poses: Matrix4[], holding: Holding, findings: Findings | null, floor: number): Group {
  const made = new Group();
  made.name = 'forces';
  const size = sizeOf(dataset), scale = metresPerNewton(dataset), forces = new Group(), cones = new Group();
  forces.name = 'contact forces';
  cones.name = 'friction cones';
  holding.contacts.forEach((contact) => addContact(contact, scale, size, forces, cones));
  made.add(cones, forces, torqueBars(dataset, poses, holding, size));
  if (findings) made.add(polygonAt(holding.polygon ?? findings.polygon, floor), collapse(holding, findings.com, size));
  return made;
}

/** Height of the lowest foot of a stance, where polygons are drawn; at most that of the centre of mass. */
export function floorOf(dataset: Dataset, poses: Matrix4[], findings: Findings): number {
  const feet = dataset.robot.feet.filter((foot) => findings.feet.some(({ link }) => link === foot.name));
  return Math.min(...feet.map((foot) => new Vector3().setFromMatrixPosition(poses[foot.link]).z + foot.lower[2]), findings.com[2]);
}
