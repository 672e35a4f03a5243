// Player of a motion in time: clock, curves under the slider, contact forces, and the joints' velocities and torques.
import { useEffect, useLayoutEffect, useMemo, useRef } from 'preact/hooks';
import { line, plot, ruleY } from '@observablehq/plot';
import type { Dataset, Holding, Playback } from './data';
import { Figure } from './figure';
import { colourOfShare } from './forces';
import { ContactForces } from './holding';
import { DASHES, colour, faint, ink } from './marks';
import { largestShares, loadsOf, mostLoaded, sampleAt, torqueShare, velocityShare, type Executable, type JointLoad } from './timed';
import { number } from './text';

const CURVE_HEIGHT = 130;

/** Calls `advance` with the seconds since the last frame while `playing`. */
export function useFrames(playing: boolean, advance: (elapsed_s: number) => void, depends: unknown[]): void {
  useEffect(() => {
    if (!playing) return undefined;
    let frame = 0, before = performance.now();  // the time of a frame may be earlier
    const step = (now: number) => {
      advance(Math.max(0, now - before) / 1000);
      before = now;
      frame = requestAnimationFrame(step);
    };
    frame = requestAnimationFrame(step);
    return () => cancelAnimationFrame(frame);
  }, [playing, ...depends]);
}

export const clockText = (time_s: number, { duration_s }: Executable): string => `${time_s.toFixed(2)} of ${duration_s.toFixed(2)} s`;

/** Slider in seconds, with the clock. */
export function TimeSlider({ playback, time, moveTo }: { playback: Executable; time: number; moveTo: (time_s: number) => void }) {
  return (
    <>
      <input type="range" aria-label="time" min={0} max={playback.duration_s} step="any" value={time} onInput={(e) => moveTo(Number(e.currentTarget.value))} />
      <output class="clock">{clockText(time, playback)}</output>
    </>
  );
}

/** Why a motion cannot be executed in time. */
export function BlockedNote({ playback, go }: { playback: Playback; go: (waypoint: number) => void }) {
  return (
    <p class="note blocked">The motion cannot be executed in time: {playback.reason}. It plays by waypoint.
      {playback.blocked_at !== undefined && <> <button class="link" onClick={() => go(playback.blocked_at!)}>Show waypoint {number(playback.blocked_at)}</button></>}</p>
  );
}

/** The largest share of a velocity and of a torque limit over time, with a cursor. */
export function ShareCurves({ dataset, playback, time }: { dataset: Dataset; playback: Executable; time: number }) {
  const rows = useMemo(() => largestShares(dataset, playback), [dataset, playback]);
  const cursor = useRef<{ line: SVGLineElement; at: (time_s: number) => number } | null>(null), now = useRef(time);
  now.current = time;
  const place = () => { if (cursor.current) for (const end of ['x1', 'x2']) cursor.current.line.setAttribute(end, String(cursor.current.at(now.current))); };
  useLayoutEffect(place, [time]);
  const draw = (width: number) => {
    const largest = Math.max(1, ...rows.map(({ velocity, torque }) => Math.max(velocity, torque)));
    const curve = (y: 'velocity' | 'torque', mark: number) => line(rows, { x: 'time_s', y, stroke: colour(mark), strokeDasharray: DASHES[mark], strokeWidth: 1.6 });
    const drawn = plot({
      width, height: CURVE_HEIGHT, marginLeft: 44, marginRight: 8, style: { color: ink(), background: 'transparent', fontSize: '11px' },
      x: { domain: [0, playback.duration_s], label: 'time, s \u2192', ticks: 6 },
      y: { domain: [0, 1.05 * largest], label: '\u2191 share of the limit', ticks: 3, tickFormat: '%' },
      marks: [ruleY([1], { stroke: faint(), strokeDasharray: '2 3' }), curve('velocity', 0), curve('torque', 1)],
    });
    const svg = (drawn.tagName === 'svg' ? drawn : drawn.querySelector('svg'))!, made = document.createElementNS('http://www.w3.org/2000/svg', 'line');
    made.setAttribute('class', 'cursor');
    made.setAttribute('y1', '0');
    made.setAttribute('y2', String(CURVE_HEIGHT - 20));
    made.setAttribute('stroke', ink());
    svg.append(made);
    const scale = drawn.scale('x')!;
    cursor.current = { line: made, at: (time_s) => scale.apply(time_s) as number };
    place();
    return drawn;
  };
  return (
    <div class="share-curves">
      <Figure name="playback" title="Velocities and torques" depends={[dataset, playback]} draw={draw}
        caption={`Largest share of a joint's velocity limit (${LINES[0]}) and torque limit (${LINES[1]}). ${nearestLimits(playback)}`}
        rows={() => [['time_s', 'velocity_share', 'torque_share'], ...rows.map(({ time_s, velocity, torque }) => [time_s, velocity, torque])]} />
    </div>
  );
}

/** Which limits decide the duration. */
function nearestLimits({ nearest }: Executable): string {
  const shares = Object.entries(nearest ?? {}).filter(([, share]) => share >= LEAST_SHARE).sort(([, a], [, b]) => b - a);
  return `Nearest limit: ${shares.map(([limit, share]) => `${limit} ${(100 * share).toFixed(0)} % of the time`).join(', ')}.`;
}

const LEAST_SHARE = 0.005;
const LINES = ['solid, blue', 'dashed, orange'];

function Bar({ share, title }: { share: number; title: string }) {
  return (
    <>
      <span class="load" title={title} role="img" aria-label={title}>
        <span style={{ width: `${Math.min(100, 100 * share)}%`, background: `#${colourOfShare(share).getHexString()}` }} /></span>
      <span class="share" aria-hidden="true">{`${(100 * share).toFixed(0)} %`}</span>
    </>
  );
}

/** "3.2 of 12 rad/s, 27 %". */
function shareText(value: number, limit: number | null, share: number, unit: string): string {
  return limit === null ? `${number(Math.abs(value))} ${unit}, no limit` : `${number(Math.abs(value))} of ${number(limit)} ${unit}, ${(100 * share).toFixed(0)} %`;
}

function JointRow({ load, lookAt }: { load: JointLoad; lookAt: (link: number) => void }) {
  const velocity = velocityShare(load), torque = torqueShare(load);
  return (
    <tr>
      <th scope="row"><button class="link" onClick={() => lookAt(load.link)}>{load.joint}</button></th>
      <td class="velocity"><Bar share={velocity} title={shareText(load.velocity, load.velocity_limit, velocity, load.prismatic ? 'm/s' : 'rad/s')} /></td>
      <td class="torque"><Bar share={torque} title={shareText(load.torque, load.torque_limit, torque, load.prismatic ? 'N' : 'N m')} /></td>
    </tr>
  );
}

interface ListProps { dataset: Dataset; playback: Executable; time: number; holding: Holding; lookAt: (link: number) => void }

/** Contact forces and loads of the joints at a time. The order of joints does not change during the motion. */
export function PlaybackList({ dataset, playback, time, holding, lookAt }: ListProps) {
  const order = useMemo(() => mostLoaded(dataset, playback), [dataset, playback]);
  const loads = loadsOf(dataset, playback, sampleAt(playback, time));
  return (
    <div class="findings">
      <ContactForces holding={holding} />
      <h3>Joints</h3>
      <div class="joint-loads"><table class="lines loads"><thead><tr><th scope="col">Joint</th><th scope="col">velocity</th><th scope="col">torque</th></tr></thead>
        <tbody>{order.map((dof) => <JointRow key={dof} load={loads[dof]} lookAt={lookAt} />)}</tbody></table></div>
      <p class="none">Bars end at the joint's limit. The joints that come nearest to a limit are first.</p>
    </div>
  );
}
