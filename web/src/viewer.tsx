// One solution: the 3D view, and a list of the judge's findings.
import { useEffect, useMemo, useRef, useState } from 'preact/hooks';
import { dot, line, plot, ruleY } from '@observablehq/plot';
import { readGeometry, readPlayback, readSolution, reasonOf, type Dataset, type Findings, type Mesh, type Overlap, type Page, type Playback, type Solution, type Trace } from './data';
import { Figure } from './figure';
import { ForceLegend, HoldingList, failingContact } from './holding';
import { exportMotion } from './gltf';
import { DASHES, colour, faint, ink } from './marks';
import { between } from './motion';
import { BlockedNote, PlaybackList, ShareCurves, TimeSlider, useFrames } from './playback';
import { View, type Layers } from './scene';
import { go, href, type State } from './state';
import { holdingOf, isExecutable, sampleAt, stateAt } from './timed';
import { length, number, save, words } from './text';

const SAMPLES = 11;  // ten between two waypoints, like the judge
const RATE = 10;     // waypoints per second at speed 1
const LEGEND_PIXELS = 110;  // length of the longest arrow of the legend
const CONTROLS = '3D view. Drag or arrow keys turn, right drag or Shift with arrow keys moves, wheel or + and - zoom, Home shows the whole robot.';

export interface Subject {
  experiment: number; job: number | null; dataset: Dataset; task: string; problem: number; title: string;
  verdict: string | null; rule?: string; unjudged?: boolean; facts: [string, string][]; others: { job: number; label: string }[]; mark: number;
}

const geometries = new Map<Dataset, Promise<Mesh[]>>();
const geometryOf = (dataset: Dataset) => {
  if (!geometries.has(dataset)) geometries.set(dataset, readGeometry(dataset));
  return geometries.get(dataset)!;
};

const RULES = ['literal', 'strict', 'solid', 'physical'];
/** Whether a pair is a collision by a rule: each rule includes the previous one. */
const failsBy = (rule: string) => (overlap: Overlap) => overlap.fails !== null && RULES.indexOf(overlap.fails) <= RULES.indexOf(rule);

/** The place of the violation that decided a verdict: a point in the world, or a link by name or index. */
function decisiveViolation(verdict: string | null, findings: Findings | null, colliding: Overlap[]): { point?: number[]; link?: string | number } | null {
  const largest = <T,>(list: T[], size: (item: T) => number) => list.reduce<T | null>((best, item) => (best === null || size(item) > size(best) ? item : best), null);
  const depth = (o: Overlap) => o.depth_m ?? o.inside_m;
  const overlapOf = (list: Overlap[]) => { const o = largest(list, depth); return o && (o.points ? { point: o.points[0] } : { link: o.link }); };
  const any = verdict === 'window_unsolved';  // the detail names the reason
  if (verdict === 'foot_pose' || any) { const foot = largest((findings?.feet ?? []).filter((f) => f.violated), (f) => f.error); if (foot) return { link: foot.link }; }
  const failing = verdict === 'equilibrium' || any ? failingContact(findings?.holding) : null;
  if (failing) return { point: failing.collapse!.at };
  if (verdict === 'push' && findings) return { point: findings.com };
  if ((verdict === 'com' || verdict === 'equilibrium' || any) && findings?.com_violated) return { point: findings.com };
  if (verdict === 'joint_limit' || any) { const limit = largest((findings?.limits ?? []).filter((l) => l.violated), (l) => l.excess); if (limit) return { link: limit.link }; }
  const value = findings?.values.find((v) => v.check === verdict && v.violated);
  if (value) return { link: value.subject };
  if (verdict === 'self_collision') return overlapOf(colliding.filter((o) => o.other !== undefined));
  if (verdict === 'environment_collision') return overlapOf(colliding.filter((o) => o.object !== undefined));
  return overlapOf(colliding);
}

/** The polygon of balance: on feet the support polygon, else that of equilibrium. */
const polygonName = ({ holding }: Findings) => (holding && holding.polygon === undefined ? 'equilibrium' : 'support');

const HOLDING_CHECKS = ['equilibrium', 'torque', 'push'];
const holdingFails = (findings: Findings) => findings.values.some((v) => v.violated && HOLDING_CHECKS.includes(v.check));

function overlapText(overlap: Overlap): string {
  const depth = overlap.depth_m !== null ? `${length(overlap.depth_m)} deep` : `vertex ${length(overlap.inside_m)} inside`;
  return `${overlap.names[0]} \u2194 ${overlap.names[1]}: ${depth}`;
}

interface ListProps { dataset: Dataset; findings: Findings | null; overlaps: Overlap[]; look: (p: number[]) => void; lookAt: (link: number) => void; fraction: boolean; rule: string }

function FindingList({ dataset, findings, overlaps, look, lookAt, fraction, rule }: ListProps) {
  const colliding = overlaps.filter(failsBy(rule)), others = overlaps.filter((o) => o.fails && !failsBy(rule)(o)), tolerated = overlaps.filter((o) => !o.fails);
  const item = (overlap: Overlap, i: number) => (
    <li key={i} class={failsBy(rule)(overlap) ? 'bad' : ''} data-fails={overlap.fails ?? ''}>
      {overlap.points ? <button class="link" onClick={() => look(overlap.points![0])}>{overlapText(overlap)}</button> : overlapText(overlap)}
      {overlap.fails && <span class="flag">{overlap.fails} rule</span>}</li>);
  return (
    <div class="findings" aria-live="polite">
      {findings?.holding && holdingFails(findings) && <HoldingList dataset={dataset} holding={findings.holding} look={look} lookAt={lookAt} />}
      <h3>Colliding pairs, {rule} rule ({colliding.length})</h3>
      {colliding.length === 0 ? <p class="none">none beyond 1 mm</p> : <ul class="colliding">{colliding.map(item)}</ul>}
      {others.length > 0 && <details><summary>{others.length} more by stricter rules</summary><ul>{others.map(item)}</ul></details>}
      {tolerated.length > 0 && <details><summary>{tolerated.length} contacts within 1 mm</summary><ul>{tolerated.map(item)}</ul></details>}
      {fraction && <p class="none">Between waypoints only overlaps are looked at; they are no part of a verdict.</p>}
      {findings && <>
        <h3>Contacts</h3>
        <ul>{findings.feet.map((foot, index) => <li key={index} class={foot.violated ? 'bad' : ''}>{foot.link}: {foot.component.startsWith('rot') ? `${number(foot.error)} (half the angle, rad)` : length(foot.error)} off in {foot.component}</li>)}</ul>
        <h3>Centre of mass</h3>
        <p class={findings.com_violated ? 'bad' : ''}>{findings.com_m === null ? 'no position is balanced' : `${length(Math.abs(findings.com_m))} ${findings.com_m > 0 ? 'outside' : 'inside'} of the ${polygonName(findings)} polygon`}</p>
        <h3>Joints at limits ({findings.limits.length})</h3>
        {findings.limits.length === 0 ? <p class="none">none</p> : <ul>{findings.limits.map((limit) => <li key={limit.joint} class={limit.violated ? 'bad' : ''}>{limit.joint} = {number(limit.value)} {limit.unit}{limit.excess > 0 ? `, ${number(limit.excess)} beyond ${number(limit.limit)}` : ' at its limit'}</li>)}</ul>}
        {findings.values.length > 0 && <h3>Other checks</h3>}
        {findings.values.map((v) => <p key={v.check} class={v.violated ? 'bad' : 'none'}>{words(v.check)}: {v.value === null ? 'infinite' : v.unit === 'm' ? length(v.value) : `${number(v.value)} ${v.unit}`}{v.subject && ` (${v.subject})`}, at most {v.tolerance}</p>)}
        {findings.holding && !holdingFails(findings) && <HoldingList dataset={dataset} holding={findings.holding} look={look} lookAt={lookAt} />}
      </>}
    </div>
  );
}

function convergence(traces: { title: string; mark: number; trace: Trace }[], measure: 'cost' | 'violation', over: 'elapsed_us' | 'evaluations', width: number): Element {
  const scale = over === 'elapsed_us' ? 1e-3 : 1;
  const positive = traces.flatMap(({ trace }) => trace[measure]).filter((v): v is number => v !== null && v > 0);
  const floor = Math.min(...positive, 1);
  const marks = traces.flatMap(({ trace, mark }) => {
    const rows = trace[measure].map((y, i) => ({ x: Math.max(scale * trace[over][i], scale), y: y === null ? null : Math.max(y, floor), z: `${trace.window[i]}.${trace.restart[i]}`, accepted: trace.accepted[i] }));
    return [line(rows, { x: 'x', y: 'y', z: 'z', stroke: colour(mark), strokeDasharray: DASHES[mark % DASHES.length], strokeWidth: 1.3 }),
      dot(rows.filter((r) => r.accepted), { x: 'x', y: 'y', fill: colour(mark), r: 2 })];
  });
  return plot({
    width, height: 220, marginLeft: 52, style: { color: ink(), background: 'transparent', fontSize: '11px' },
    x: { type: 'log', label: over === 'elapsed_us' ? 'time, ms \u2192' : 'term evaluations \u2192', grid: true, ticks: 5, tickFormat: '~g' },
    y: { type: 'log', label: `\u2191 ${measure}`, grid: true, ticks: 5, tickFormat: '~g' },
    marks: [ruleY([floor], { stroke: faint(), strokeOpacity: 0.3 }), ...marks],
  });
}

function Convergence({ traces, state, unknown }: { traces: { title: string; mark: number; trace: Trace }[]; state: State; unknown: string }) {
  if (traces.length === 0) return <p class="none">{unknown || 'No trace was recorded: the solver took no step, or the release was older.'}</p>;
  const over = state.per === 'evaluations' ? 'evaluations' : 'elapsed_us';
  const rows = (measure: 'cost' | 'violation') => [['method', over, measure, 'window', 'restart', 'accepted'],
    ...traces.flatMap(({ title, trace }) => trace[measure].map((v, i) => [title, trace[over][i], v, trace.window[i], trace.restart[i], trace.accepted[i]]))];
  const caption = `${traces.map((t) => `${t.title}: ${t.trace.cost.length} of ${t.trace.of} recorded steps`).join('; ')}; dots were accepted, a line is one restart of one window. The cost is the optimiser's own.`;
  return (
    <div>
      <div class="bar"><label>Over <select value={over} onChange={(e) => go({ per: e.currentTarget.value === 'evaluations' ? 'evaluations' : undefined }, true)}>
        <option value="elapsed_us">time</option><option value="evaluations">term evaluations</option></select></label></div>
      <div class="figures">{(['violation', 'cost'] as const).map((measure) => (
        <Figure key={measure} name={`trace-${measure}`} title={`Convergence: ${measure}`} caption={caption} depends={[traces, over]}
          draw={(width) => convergence(traces, measure, over, width)} rows={() => rows(measure)} />))}</div>
    </div>
  );
}

/** Whether forces are drawn at first: if they decide the verdict, or where hands carry. */
const showsForces = (subject: Subject, solution: Solution | null): boolean =>
  HOLDING_CHECKS.includes(subject.verdict ?? '') || (solution?.findings?.some((f) => f.holding && f.holding.polygon === undefined) ?? false);

/** The sample nearest to a slider position, in [0, 1). */
const overlapsAt = (solution: Solution, at: number): Overlap[] => {
  const w = Math.floor(at + 1e-9), s = at - w;
  if (s < 1e-6) return solution.findings?.[w]?.overlaps ?? [];
  return solution.between?.find(([from, share]) => from === w && Math.abs(share - s) < 0.5 / SAMPLES)?.[2] ?? [];
};

/** The last slider position: the number of waypoints minus one. */
const lastOf = ({ x, times }: Solution): number => Math.max(0, times ? times[times.length - 1] ?? 0 : x.length - 1);

/** Configuration at a slider position, in steps from waypoint to waypoint. */
const configuration = ({ x, times }: Solution, at: number): Float64Array => {
  const stamp = (i: number) => times?.[i] ?? i;
  let i = Math.min(Math.floor(at + 1e-9), x.length - 1);  // limited to the last point: no path has fewer points than
                                                          // waypoints
  while (i + 1 < x.length && stamp(i + 1) <= at + 1e-9) ++i;
  const s = i + 1 < x.length ? (at - stamp(i)) / (stamp(i + 1) - stamp(i)) : 0;
  return s < 1e-6 ? x[i] : between(x[i], x[i + 1], s);
};

export function Viewer({ page, subject, state }: { page: Page; subject: Subject; state: State }) {
  const canvas = useRef<HTMLCanvasElement>(null), view = useRef<View | null>(null);
  const [solution, setSolution] = useState<Solution | null | undefined>(undefined);
  const [ghost, setGhost] = useState<Solution | null>(null);
  const [problem, setProblem] = useState('');         // reason for which nothing can be drawn
  const [failure, setFailure] = useState('');         // reason for which the solution could not be loaded
  const [ghostFailure, setGhostFailure] = useState('');
  const [at, setAt] = useState(0);
  const [playback, setPlayback] = useState<Playback | null | undefined>(undefined);  // undefined: not loaded yet
  const [playbackFailure, setPlaybackFailure] = useState('');
  const [inTime, setInTime] = useState(false);        // the slider has seconds, not waypoints
  const [time, setTime] = useState(0);
  const [playing, setPlaying] = useState(false);
  const [speed, setSpeed] = useState(1);
  const [ready, setReady] = useState(false);
  const [layers, setLayers] = useState<Layers>({ convex: false, scene: true, findings: true, steps: true, follow: false, forces: false });
  const [pixelsPerNewton, setPixelsPerNewton] = useState(0);
  const rule = state.rule ?? page.rule ?? subject.rule ?? 'literal';
  const ghostJob = state.ghost === undefined ? null : Number(state.ghost);

  useEffect(() => {
    let left = false;
    setSolution(undefined);
    setFailure('');
    setPlaying(false);
    if (subject.job === null) { setSolution(null); return undefined; }
    readSolution(page, subject.experiment, subject.job).then((found) => {
      if (left) return;
      setSolution(found);
      setLayers((chosen) => ({ ...chosen, forces: showsForces(subject, found) }));
      setAt(state.w !== undefined ? Number(state.w) : found?.failed_waypoint ?? found?.unsolved?.from ?? 0);
    }).catch((error) => { if (!left) setFailure(reasonOf(error)); });
    return () => { left = true; };
  }, [subject.experiment, subject.job]);
  useEffect(() => {
    let left = false;
    setPlayback(undefined);
    setPlaybackFailure('');
    setInTime(false);
    setTime(0);
    if (!solution || solution.x.length < 2) return undefined;
    readPlayback(solution.job).then((found) => {
      if (left) return;
      setPlayback(found);
      if (!isExecutable(found) || state.w !== undefined || solution.failed_waypoint !== undefined) return;
      setInTime(true);
      setLayers((chosen) => ({ ...chosen, forces: true }));
    }).catch((error) => { if (!left) setPlaybackFailure(reasonOf(error)); });
    return () => { left = true; };
  }, [solution]);
  useEffect(() => {
    let left = false;
    setGhost(null);
    setGhostFailure('');
    if (ghostJob !== null) {
      readSolution(page, subject.experiment, ghostJob).then((found) => { if (!left) setGhost(found); }).catch((error) => { if (!left) setGhostFailure(reasonOf(error)); });
    }
    return () => { left = true; };
  }, [subject.experiment, ghostJob]);

  useEffect(() => {
    let gone = false;
    setReady(false);
    geometryOf(subject.dataset).then((meshes) => {
      if (gone || !canvas.current) return;
      try {
        view.current = new View(canvas.current, subject.dataset, meshes);
        view.current.onZoom = () => setPixelsPerNewton(view.current?.pixelsPerNewton() ?? 0);
      } catch {
        setProblem('This browser has no WebGL, so that nothing can be drawn in 3D; the findings beside are the same without it.');
        return;
      }
      const fit = () => { const box = canvas.current!.parentElement!; view.current!.resize(box.clientWidth, Math.max(260, Math.min(620, box.clientWidth * 0.75))); };
      fit();
      const observer = new ResizeObserver(fit);
      observer.observe(canvas.current.parentElement!);
      const scheme = matchMedia('(prefers-color-scheme: dark)'), paint = () => view.current?.paint();
      scheme.addEventListener('change', paint);
      (window as unknown as { legopt: Record<string, unknown> }).legopt.view = view.current;
      setReady(true);
      const made = view.current;
      cleanups.push(() => { observer.disconnect(); scheme.removeEventListener('change', paint); made.dispose(); });
    }).catch((error) => setProblem(`Robot and scene cannot be loaded: ${reasonOf(error)}`));
    const cleanups: (() => void)[] = [];
    return () => { gone = true; cleanups.forEach((f) => f()); view.current = null; };
  }, [subject.dataset]);

  const timed = inTime && isExecutable(playback) ? playback : null;
  const moment = useMemo(() => (timed ? stateAt(timed, time) : null), [timed, time]);
  const holding = useMemo(() => (timed ? holdingOf(subject.dataset, timed, sampleAt(timed, time)) : null), [timed, time]);
  const x = solution?.x ?? [], last = solution ? lastOf(solution) : 0, place = moment?.waypoint ?? Math.min(at, last);
  const stances = subject.dataset.problems[subject.task]?.[String(subject.problem)] ?? [];
  const unsolved = solution?.unsolved, attempt = unsolved !== undefined && Math.floor(place + 1e-9) >= unsolved.from;
  const perStance = unsolved?.waypoints_per_stance ?? (last + 1) / Math.max(1, stances.length);
  const present = x.length > 0 ? Math.min(stances.length - 1, Math.floor(Math.floor(place + 1e-9) / perStance)) : 0;
  const fraction = place - Math.floor(place + 1e-9) > 1e-6;
  const findings = !fraction && !timed ? solution?.findings?.[Math.floor(place + 1e-9)] ?? null : null;
  const overlaps = useMemo(() => (solution && !timed ? overlapsAt(solution, place) : []), [solution, place, timed]);

  useEffect(() => {
    const shown = view.current;
    if (!shown || !ready || solution === undefined) return;
    Object.assign(shown.layers, layers);
    const now = moment?.x ?? (solution && x.length > 0 ? configuration(solution, place) : null);
    shown.show(now, ghost && ghost.x.length > 0 ? configuration(ghost, Math.min(place, lastOf(ghost))) : null);
    shown.drawTargets(stances, present);
    shown.drawFindings(findings, overlaps, failsBy(rule), now, attempt);
    shown.drawForces(holding ?? findings?.holding, findings);
    shown.apply();
  }, [ready, solution, ghost, place, layers, rule, timed]);
  useEffect(() => {
    if (!ready || solution === undefined || !view.current) return;
    if (x.length === 0) view.current.lookAtFeet(stances.flatMap((stance) => stance.feet));
    else view.current.look();
    const decisive = decisiveViolation(subject.verdict, findings, overlaps.filter(failsBy(rule)));
    if (decisive?.point) view.current.look(decisive.point);
    else if (decisive?.link !== undefined) view.current.lookAtLink(decisive.link);
    (window as unknown as { legopt: Record<string, unknown> }).legopt.looksAt = subject.job;
  }, [ready, solution]);
  useFrames(playing, (elapsed_s) => {
    const [set, rate, end] = timed ? [setTime, speed, timed.duration_s] as const : [setAt, RATE * speed, last] as const;
    set((before) => { const next = before + elapsed_s * rate; if (next >= end) { setPlaying(false); return end; } return next; });
  }, [speed, last, timed]);

  const moveTo = (value: number) => { setPlaying(false); setInTime(false); setAt(value); go({ w: value === 0 ? undefined : Math.round(value * SAMPLES) / SAMPLES }, true); };
  const collidingAt = useMemo(() => {
    const places: number[] = [];
    solution?.findings?.forEach((f, w) => { if (f.com_violated || f.feet.some((foot) => foot.violated) || f.limits.some((l) => l.violated) || f.overlaps.some(failsBy(rule)) || (rule === 'physical' && holdingFails(f))) places.push(w); });
    solution?.between?.forEach(([w, s, list]) => { if (list.some(failsBy(rule))) places.push(w + s); });
    return places.sort((a, b) => a - b);
  }, [solution, rule]);
  const traces = [
    ...(solution?.trace ? [{ title: subject.title, mark: subject.mark, trace: solution.trace }] : []),
    ...(ghost?.trace ? [{ title: `job ${ghost.job}`, mark: subject.mark + 1, trace: ghost.trace }] : [])];
  const unknown = failure ? `The trace cannot be loaded: ${failure}` : solution === undefined ? 'Loading.' : solution === null ? 'This file does not hold the trace.' : '';
  const toggle = (key: keyof Layers, label: string) => (
    <label key={key}><input type="checkbox" checked={layers[key]} onChange={() => setLayers({ ...layers, [key]: !layers[key] })} /> {label}</label>);

  return (
    <div class="job-view">
      <h2>{subject.title}</h2>
      <table class="lines facts"><tbody>{subject.facts.map(([name, value]) => <tr key={name}><th scope="row">{name}</th><td>{value}</td></tr>)}</tbody></table>
      {subject.job !== null && solution === null && <p class="note">This file does not hold the solution of job {subject.job}: left out for size, or it has none. <code>legopt view {subject.job}</code> draws it.</p>}
      {unsolved && <p class="note">{unsolved.from > 0 ? `The motion is solved before waypoint ${unsolved.from}. ` : ''}From waypoint {unsolved.from} on, the robot (in purple) is at the best point that the solver found for the window that it did not solve.</p>}
      {solution?.malformed && <p class="note">Its waypoints have not the robot's size and cannot be drawn.</p>}
      {problem && <p class="note" role="alert">{problem}</p>}
      {ghostFailure && <p class="note" role="alert">Job {ghostJob} cannot be loaded: {ghostFailure}</p>}
      <div class="stage">
        <div class="canvas-side">
          <div class="canvas-box">
            {failure && <p class="note" role="alert">The solution of job {subject.job} cannot be loaded: {failure}</p>}
            <canvas ref={canvas} tabIndex={0} aria-label={CONTROLS} title={CONTROLS} onKeyDown={(e) => { if (view.current?.press(e)) e.preventDefault(); }} style={problem || failure ? { display: 'none' } : {}} />
            {layers.forces && (holding ?? findings?.holding) && !problem && !failure && pixelsPerNewton > 0 && <ForceLegend pixelsPerNewton={pixelsPerNewton} most={LEGEND_PIXELS} />}</div>
          {x.length > 1 && <div class="bar player">
            <button onClick={() => { if (timed && time >= timed.duration_s) setTime(0); if (!timed && place >= last) setAt(0); setPlaying(!playing); }} aria-label={playing ? 'pause' : 'play'}>{playing ? '\u275a\u275a' : '\u25b6'}</button>
            {timed ? <TimeSlider playback={timed} time={time} moveTo={(time_s) => { setPlaying(false); setTime(time_s); }} /> : <>
              <input type="range" aria-label="waypoint" min={0} max={last} step={solution?.between || solution?.times ? 1 / SAMPLES : 1} value={place} onInput={(e) => moveTo(Number(e.currentTarget.value))} />
              <output>waypoint {String(Math.round(place * 100) / 100)} of {last}{attempt && ', not solved'}</output></>}
            <label>speed <select value={speed} onChange={(e) => setSpeed(Number(e.currentTarget.value))}>{[0.25, 0.5, 1, 2, 5].map((s) => <option key={s} value={s}>{s}</option>)}</select></label>
            {isExecutable(playback) && <label><input type="checkbox" checked={inTime} onChange={() => { setPlaying(false); setInTime(!inTime); }} /> in time</label>}
          </div>}
          {timed && <ShareCurves dataset={subject.dataset} playback={timed} time={time} />}
          {playback && !isExecutable(playback) && <BlockedNote playback={playback} go={moveTo} />}
          {playbackFailure && <p class="note" role="alert">The shortest time of the motion cannot be loaded: {playbackFailure}</p>}
          {x.length > 1 && playback === undefined && !playbackFailure && <p class="none">The shortest time of the motion is being computed.</p>}
          <div class="bar">
            {solution?.failed_waypoint !== undefined && x.length > 1 && <button onClick={() => moveTo(solution.failed_waypoint!)}>failed waypoint {solution.failed_waypoint}</button>}
            {x.length > 1 && collidingAt.length > 0 && <button onClick={() => moveTo(collidingAt.find((p) => p > place + 1e-3) ?? collidingAt[0])}>next of {collidingAt.length} violations</button>}
            {unsolved && x.length > 1 && <button onClick={() => moveTo(unsolved.from)}>unsolved window, from waypoint {unsolved.from}</button>}
            <button onClick={() => view.current?.look()}>whole robot</button>
            {x.length > 0 && <button onClick={() => geometryOf(subject.dataset).then((m) => exportMotion(subject.dataset, m, x, solution?.times, solution?.findings)).then((glb) => save(`job-${subject.job}.glb`, glb, 'model/gltf-binary'))}>glTF</button>}
            <label>Rule <select value={rule} onChange={(e) => go({ rule: e.currentTarget.value }, true)}>{RULES.map((r) => <option key={r}>{r}</option>)}</select></label>
            {toggle('convex', "solver's convex pieces")}{toggle('scene', 'scene')}{toggle('findings', 'findings')}{toggle('forces', 'forces')}{toggle('steps', 'footholds')}{toggle('follow', 'follow')}
          </div>
          {subject.others.length > 0 && <div class="bar"><label>Ghost: <select value={ghostJob ?? ''} onChange={(e) => go({ ghost: e.currentTarget.value || undefined }, true)}>
            <option value="">none</option>{subject.others.map((o) => <option key={o.job} value={o.job}>{o.label}</option>)}</select></label>
            {ghostJob !== null && <a href={href({ job: ghostJob, ghost: subject.job ?? undefined, w: undefined })}>swap</a>}</div>}
          <p class="caption">The drawing shows the exact meshes that the judge uses. Orange and yellow: a colliding pair with its witness points; green: footholds and centre of mass, blue: support polygon; light blue balls: joints at limits. Forces: arrows and friction cones at contacts (pink: at the limit of friction), torques along the joints' axes, purple: equilibrium polygon. {words(subject.dataset.name)}, metres.</p>
        </div>
        {timed && holding ? <PlaybackList dataset={subject.dataset} playback={timed} time={time} holding={holding} lookAt={(link) => view.current?.lookAtLink(link)} />
          : solution && (solution.findings || solution.between
          ? <FindingList dataset={subject.dataset} findings={findings} overlaps={overlaps} fraction={fraction} rule={rule} look={(p) => view.current?.look(p)} lookAt={(link) => view.current?.lookAtLink(link)} />
          : solution.times ? <p class="none">A path of {x.length} points{solution.failed_waypoint === undefined ? '.' : '; what the judge found is said above.'}</p>
          : subject.unjudged ? <p class="none">Not judged here: violations and forces are not known. <code>legopt archive unpack</code> judges an archive, then <code>legopt view</code> shows them.</p>
          : <p class="none">Solved: no violation by the rule. <code>legopt view {subject.job}</code> lists each waypoint.</p>)}
      </div>
      {subject.job !== null && <Convergence traces={traces} state={state} unknown={unknown} />}
    </div>
  );
}

