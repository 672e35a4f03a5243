// Profiles, runtime and cost distributions; plotted here, computed by legopt/statistics.
import { dot, line, plot, ruleX, ruleY, text as textMark, type Markish } from '@observablehq/plot';
import { ask, useAnswer } from './background';
import type { ColumnFigures, Curve, Experiment } from './data';
import { Figure } from './figure';
import { DASHES, SIGNS, colour, faint, ink, symbol } from './marks';
import { go, type State } from './state';
import { captionOf } from './table';

export interface Shown { title: string; mark: number; curve: Curve | null; hidden?: boolean }

interface Point { x: number; y: number }

/** A rising step curve with one step for each pixel: the first place, the last height. */
function thinned(points: Point[], pixel: (x: number) => number): Point[] {
  const kept: Point[] = [];
  let last = NaN;
  for (const point of points) {
    const at = Math.round(pixel(point.x));
    if (at === last) kept[kept.length - 1].y = point.y; else kept.push({ ...point });
    last = at;
  }
  return kept;
}

/** Step curves from `start`, each extended to the right edge and labelled there. */
export function stepPlot(shown: Shown[], options: { width: number; start: number; log: boolean; label: string; limit?: number }): Element {
  const all = shown.filter((s) => s.curve && s.curve.x.length > 0), drawn = all.filter((s) => !s.hidden);  // all: for axes
  const largest = Math.max(options.start * 1.5, ...all.map((s) => s.curve!.x[s.curve!.x.length - 1])) || 1;
  const right = options.log ? largest * 1.15 : largest * 1.05;
  const smallest = all.length > 0 ? Math.min(...all.map((s) => s.curve!.x[0]), largest) : largest / 10;
  const left = options.start > 0 ? options.start : options.log ? smallest * 0.8 : 0;
  const scaled = options.log ? Math.log : (x: number) => x;
  const pixel = (x: number) => (options.width * (scaled(x) - scaled(left))) / (scaled(right) - scaled(left));
  const marks: Markish[] = [ruleY([0, 1], { stroke: faint(), strokeOpacity: 0.5 })];
  if (options.limit && options.limit < right) marks.push(ruleX([options.limit], { stroke: faint(), strokeDasharray: '2 3' }));
  const ends: { y: number; title: string; mark: number }[] = [];
  for (const s of drawn) {
    const { x, y } = s.curve!, steps: Point[] = [{ x: left, y: 0 }];
    for (let i = 0; i < x.length; ++i) if (x[i] >= left) steps.push({ x: x[i], y: y[i] }); else steps[0].y = y[i];
    steps.push({ x: right, y: y[y.length - 1] });
    const points = thinned(steps, pixel);
    marks.push(line(points, { x: 'x', y: 'y', curve: 'step-after', stroke: colour(s.mark), strokeWidth: 1.8, strokeDasharray: DASHES[s.mark % DASHES.length] }));
    const some = points.filter((_, i) => i % Math.max(1, Math.floor(points.length / 6)) === 0);
    marks.push(dot(some, { x: 'x', y: 'y', symbol: symbol(s.mark), stroke: colour(s.mark), fill: colour(s.mark), r: 2.6 }));
    ends.push({ y: points[points.length - 1].y, title: s.title, mark: s.mark });
  }
  ends.sort((a, b) => b.y - a.y);
  let last = 2;
  for (const end of ends) {
    const y = Math.min(end.y, last - 0.06);
    last = y;
    marks.push(textMark([{ x: right, y }], { x: 'x', y: 'y', text: () => `${SIGNS[end.mark % SIGNS.length]} ${end.title}`, fill: colour(end.mark), textAnchor: 'start', dx: 4 }));
  }
  return plot({
    width: options.width, height: 300, marginRight: 132, marginLeft: 44, style: { color: ink(), background: 'transparent', fontSize: '11px' },
    x: { type: options.log ? 'log' : 'linear', domain: [left, right], label: options.label, grid: true, ticks: 5, tickFormat: '~g' },
    y: { domain: [0, 1], label: 'share of problems \u2191', ticks: [0, 0.25, 0.5, 0.75, 1], tickFormat: (v: number) => String(v), grid: true },
    marks,
  });
}

export function curveRows(shown: Shown[], x: string): (string | number)[][] {
  const rows: (string | number)[][] = [['method', x, 'share']];
  for (const { title, curve } of shown.filter((one) => !one.hidden)) for (let i = 0; curve && i < curve.x.length; ++i) rows.push([title, curve.x[i], curve.y[i]]);
  return rows;
}

/** Words for the measures of effort: the measure, its least value, a method with less of it. */
export const EFFORTS = { work: { label: 'work', least: 'least work', less: 'needs less work' }, time: { label: 'time', least: 'shortest time', less: 'is faster' } };

interface SetProps { figures: ColumnFigures; names: { title: string; mark: number; hidden?: boolean }[]; caption: string; log: boolean; name: string; pool: string; depends: unknown[] }

/** The four figures of one pool of methods on one task from one initial guess. */
export function CurveSet({ figures, names, caption, log, name, pool, depends }: SetProps) {
  const shown = (curves: (Curve | null)[] | undefined): Shown[] =>
    names.map(({ title, mark, hidden }, i) => ({ title, mark, hidden, curve: curves?.[i] ?? null }));
  const { effort, cost } = figures.profiles, { least, label } = EFFORTS[figures.effort];
  const limit = figures.effort === 'time' ? figures.limit_ms : undefined, complete = figures.complete ?? figures.problems.length;
  if (complete === 0) return <p class="note">No problem has been completed by every method that has begun: there are no curves yet.</p>;
  return (
    <div class="figures">
      {effort && <Figure name={`${name}-profile-${figures.effort}`} depends={depends} title={`Performance profile of ${label}`}
        caption={`Share of ${effort.problems} problems solved within a factor of the ${least} of ${pool}; ${effort.unsolved} solved by none. Only the distance to the best can be read from it. ${caption}`}
        draw={(width) => stepPlot(shown(effort.curves), { width, start: 1, log, label: `${label} / ${least} \u2192` })} rows={() => curveRows(shown(effort.curves), 'ratio')} />}
      <Figure name={`${name}-${figures.effort}`} depends={depends} title={`Distribution of ${label}`}
        caption={`Share of ${complete} problems solved within an amount of ${label}; what failed never arrives.${limit ? ` Limit ${limit / 1e3} s.` : ''} ${caption}`}
        draw={(width) => stepPlot(shown(figures.efforts), { width, start: 0, log, label: `${label}, ms \u2192`, limit })} rows={() => curveRows(shown(figures.efforts), `${figures.effort}_ms`)} />
      {cost && <Figure name={`${name}-profile-cost`} depends={depends} title="Performance profile of costs"
        caption={`Share of ${cost.problems} problems solved within a factor of the cheapest solution of ${pool}. ${caption}`}
        draw={(width) => stepPlot(shown(cost.curves), { width, start: 1, log, label: 'cost / cheapest \u2192' })} rows={() => curveRows(shown(cost.curves), 'ratio')} />}
      {!cost && <Figure name={`${name}-costs`} depends={depends} title="Costs beside the best"
        caption={`Share of ${complete} problems solved within a factor of the best known cost. ${caption}`}
        draw={(width) => stepPlot(shown(figures.costs), { width, start: 1, log, label: 'cost / best known \u2192' })} rows={() => curveRows(shown(figures.costs), 'ratio')} />}
    </div>
  );
}

export function ColumnChoice({ experiment, state }: { experiment: Experiment; state: State }) {
  return (
    <label>Task and start: <select value={state.c ?? '0'} onChange={(e) => go({ c: e.currentTarget.value })}>
      {experiment.columns.map((column, c) => <option value={c} key={c}>{column.title}</option>)}</select></label>
  );
}

/** Methods to hide by a click; a double click shows one alone. Hiding changes no other curve. */
function Legend({ experiment, hidden }: { experiment: Experiment; hidden: Set<number> }) {
  const put = (next: Set<number>) => go({ hide: next.size > 0 ? [...next].sort().join('.') : undefined }, true);
  return (
    <div class="legend" role="group" aria-label="Methods shown">
      {experiment.methods.map((method, m) => (
        <button key={m} aria-pressed={!hidden.has(m)} class={hidden.has(m) ? 'off' : ''} title="click: hide or show; double click: alone"
          onClick={() => { const next = new Set(hidden); if (!next.delete(m)) next.add(m); put(next); }}
          onDblClick={() => put(new Set(experiment.methods.map((_, i) => i).filter((i) => i !== m)))}>
          <span style={{ color: colour(m) }} aria-hidden="true">{SIGNS[m % SIGNS.length]}</span> {method.choice}</button>))}
      {hidden.size > 0 && <button onClick={() => put(new Set())}>show all</button>}
    </div>
  );
}

export function ProfileView({ experiment, state }: { experiment: Experiment; state: State }) {
  const e = Number(state.e ?? 0), c = Math.min(Number(state.c ?? 0), experiment.columns.length - 1), log = state.lin === undefined;
  const figures = useAnswer(`${e} ${c}`, () => ask('column', e, c), [experiment]);
  const hidden = new Set((state.hide ?? '').split('.').filter(Boolean).map(Number));
  const names = experiment.methods.map((method, m) => ({ title: method.choice, mark: m, hidden: hidden.has(m) }));
  return (
    <>
      <div class="bar"><ColumnChoice experiment={experiment} state={state} />
        <label><input type="checkbox" checked={log} onChange={() => go({ lin: log ? '1' : undefined }, true)} /> logarithmic</label></div>
      <Legend experiment={experiment} hidden={hidden} />
      {figures && <CurveSet name={`${experiment.columns[c].task}-${experiment.columns[c].initialization}`} figures={figures} names={names} log={log}
        pool={`all ${experiment.methods.length} methods`} caption={`${experiment.columns[c].title}. ${captionOf(experiment)}`} depends={[figures, log, state.hide]} />}
    </>
  );
}
