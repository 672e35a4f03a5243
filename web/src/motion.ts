// Link poses of the robot for drawing, by the link tree that C++ wrote; tested to agree with its kinematics.
import { Matrix4, Quaternion, Vector3 } from 'three';
import type { Dataset, Pose } from './data';

export const poseMatrix = (pose: Pose) => new Matrix4().compose(
  new Vector3(pose[0], pose[1], pose[2]), new Quaternion(pose[4], pose[5], pose[6], pose[3]), new Vector3(1, 1, 1));

export class LinkTree {
  readonly poses: Matrix4[];
  private readonly origins: Matrix4[];
  private readonly axes: Vector3[];

  constructor(private readonly robot: Dataset['robot']) {
    this.poses = robot.links.map(() => new Matrix4());
    this.origins = robot.joints.map((joint) => poseMatrix(joint.origin));
    this.axes = robot.joints.map((joint) => new Vector3(...joint.axis));
  }

  /** Poses of all links at a configuration: joints (clamped to their limits, as by the judge), base position, wxyz. */
  update(x: ArrayLike<number>): Matrix4[] {
    const n = this.robot.dofs.length;
    const q = new Quaternion(x[n + 4], x[n + 5], x[n + 6], x[n + 3]).normalize();
    this.poses[0].compose(new Vector3(x[n], x[n + 1], x[n + 2]), q, new Vector3(1, 1, 1));
    const motion = new Matrix4();
    this.robot.joints.forEach((joint, j) => {
      const pose = this.poses[joint.child].multiplyMatrices(this.poses[joint.parent], this.origins[j]);
      if (joint.dof < 0) return;
      const clamped = Math.max(joint.lower ?? -Infinity, Math.min(joint.upper ?? Infinity, x[joint.dof]));
      const value = joint.multiplier * clamped + joint.offset; // 1 and 0 unless it follows another joint
      const axis = this.axes[j];
      if (joint.type === 'prismatic') motion.makeTranslation(axis.x * value, axis.y * value, axis.z * value);
      else motion.makeRotationAxis(axis, value);
      pose.multiply(motion);
    });
    return this.poses;
  }

  com(): Vector3 {
    const sum = new Vector3();
    let mass = 0;
    this.robot.links.forEach((link, i) => {
      sum.addScaledVector(new Vector3(...link.com).applyMatrix4(this.poses[i]), link.mass_kg);
      mass += link.mass_kg;
    });
    return sum.divideScalar(mass || 1);
  }
}

/** Interpolates two waypoints: joints and base linearly, the rotation by the shortest path (legopt/robot/configuration.h). */
export function between(a: Float64Array, b: Float64Array, s: number): Float64Array {
  const x = new Float64Array(a.length), n = a.length - 7;
  for (let i = 0; i < n + 3; ++i) x[i] = a[i] + s * (b[i] - a[i]);
  const q = new Quaternion(a[n + 4], a[n + 5], a[n + 6], a[n + 3]).normalize()
    .slerp(new Quaternion(b[n + 4], b[n + 5], b[n + 6], b[n + 3]).normalize(), s);
  x.set([q.w, q.x, q.y, q.z], n + 3);
  return x;
}

/** The largest deviation of a link pose from the C++ result for the dataset's test configuration: m, and quaternion. */
export function checkPoses(dataset: Dataset): number {
  const tree = new LinkTree(dataset.robot);
  tree.update(dataset.check.x);
  let worst = 0;
  const p = new Vector3(), q = new Quaternion(), scale = new Vector3();
  tree.poses.forEach((pose, i) => {
    pose.decompose(p, q, scale);
    const [x, y, z, w, a, b, c] = dataset.check.poses[i];
    const sign = w * q.w + a * q.x + b * q.y + c * q.z < 0 ? -1 : 1;
    for (const d of [p.x - x, p.y - y, p.z - z, sign * q.w - w, sign * q.x - a, sign * q.y - b, sign * q.z - c]) worst = Math.max(worst, Math.abs(d));
  });
  return worst;
}
