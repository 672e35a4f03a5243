// A motion executed in time: the state at a time, its forces in the form of a posture's, and shares of limits.
import type { ContactHolding, Dataset, Holding, Playback } from './data';
import { jointOf } from './forces';
import { between } from './motion';

/** A motion that can be executed. */
export type Executable = Playback & { duration_s: number };

export const isExecutable = (playback: Playback | null | undefined): playback is Executable => typeof playback?.duration_s === 'number';

/** Index of the last sample at or before a time. */
export function sampleAt({ times_s }: Executable, time_s: number): number {
  let low = 0, high = times_s.length - 1;
  while (low < high) {
    const middle = Math.ceil((low + high) / 2);
    if (times_s[middle] <= time_s) low = middle; else high = middle - 1;
  }
  return low;
}

/** Configuration and place on the path, in steps from waypoint to waypoint, at a time. */
export function stateAt(playback: Executable, time_s: number): { x: Float64Array; waypoint: number } {
  const { times_s, x, waypoints } = playback, k = sampleAt(playback, time_s), here = Float64Array.from(x[k]);
  if (k + 1 >= times_s.length) return { x: here, waypoint: waypoints[k] };
  const share = (time_s - times_s[k]) / (times_s[k + 1] - times_s[k]);
  return { x: between(here, Float64Array.from(x[k + 1]), share), waypoint: waypoints[k] + share * (waypoints[k + 1] - waypoints[k]) };
}

/** Contact forces and torques of a sample. */
export function holdingOf(dataset: Dataset, { points, forces, torques }: Executable, sample: number): Holding {
  const contacts: ContactHolding[] = [];
  for (const [index, ...force_N] of forces[sample]) {
    const { contact, at, normal, friction } = points[index];
    let entry = contacts.find((one) => one.contact === contact);
    if (!entry) { entry = { contact, normal, friction, forces: [] }; contacts.push(entry); }
    entry.forces.push({ at, force_N });
  }
  const efforts = dataset.robot.efforts ?? [];
  return {
    balanced: true, contacts, polygon: [], torques: torques[sample],
    overloaded: torques[sample].flatMap((torque, dof) => (Math.abs(torque) > (efforts[dof] ?? Infinity) * OVERLOAD ? [dof] : [])),
  };
}

/** Share of a limit from which a joint counts as overloaded: between the points of the time law's grid, torques may be a little above it. */
const OVERLOAD = 1.02;

/** A joint with its load at one sample; null: no limit. */
export interface JointLoad { dof: number; joint: string; link: number; prismatic: boolean; velocity: number; velocity_limit: number | null; torque: number; torque_limit: number | null }

export function loadsOf(dataset: Dataset, { velocities, torques }: Executable, sample: number): JointLoad[] {
  const { efforts, velocities: limits } = dataset.robot;
  return dataset.robot.dofs.map((joint, dof) => {
    const described = jointOf(dataset, dof);
    return {
      dof, joint, link: described?.child ?? 0, prismatic: described?.type === 'prismatic',
      velocity: velocities[sample][dof], velocity_limit: limits?.[dof] ?? null, torque: torques[sample][dof], torque_limit: efforts?.[dof] ?? null,
    };
  });
}

const shareOf = (value: number, limit: number | null): number => (limit === null ? 0 : Math.abs(value) / limit);
export const velocityShare = (load: JointLoad): number => shareOf(load.velocity, load.velocity_limit);
export const torqueShare = (load: JointLoad): number => shareOf(load.torque, load.torque_limit);

/** Largest shares of velocity and torque limits over the joints, per sample. */
export function largestShares(dataset: Dataset, playback: Executable): { time_s: number; velocity: number; torque: number }[] {
  return playback.times_s.map((time_s, k) => {
    const loads = loadsOf(dataset, playback, k);
    return { time_s, velocity: Math.max(0, ...loads.map(velocityShare)), torque: Math.max(0, ...loads.map(torqueShare)) };
  });
}

/** Degrees of freedom with a limit, those that come nearest to one during the motion first. */
export function mostLoaded(dataset: Dataset, playback: Executable): number[] {
  const largest = dataset.robot.dofs.map(() => 0);
  playback.times_s.forEach((_, k) => loadsOf(dataset, playback, k).forEach((load) => { largest[load.dof] = Math.max(largest[load.dof], velocityShare(load), torqueShare(load)); }));
  return largest.map((_, dof) => dof).filter((dof) => largest[dof] > 0).sort((a, b) => largest[b] - largest[a]);
}
