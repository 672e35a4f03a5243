// A compared with B, as by `legopt compare`.
import { dot, line, plot, pointer, ruleX, ruleY, text as textMark, tip } from '@observablehq/plot';
import { ask, useAnswer } from './background';
import type { CellComparison, ColumnFigures, Experiment, Page, Pair, PairFigures, Ratio } from './data';
import { CurveSet, EFFORTS } from './curves';
import { Figure } from './figure';
import { colour, failure, faint, ink } from './marks';
import { go, href, type State } from './state';
import { DASH, interval, number, p, time } from './text';
import { captionOf } from './table';

const VERDICTS: Record<string, string> = { none: 'no difference shown', better: 'B is better', worse: 'B is worse', mixed: 'mixed: better in one, worse in another' };
const MOST_LINKS = 500;  // points that are links of their own; with more, the point at the pointer is one
const RUNTIMES: Record<string, string> = { equal: 'equal', a: 'A has solved at least as many at every time', b: 'B has solved at least as many at every time', crossing: 'the curves cross' };

interface Point { x: number; y: number; problem: number; job: number | null; kind: string }

/** Problems by the values of both methods; unsolved by one: on the border, by both: in the corner. */
function points(figures: ColumnFigures, measure: 'effort_ms' | 'cost', rim: number): Point[] {
  const [a, b] = figures.methods;
  return [...figures.problems.keys()].filter((i) => a.share[i] !== null && b.share[i] !== null).map((i) => {
    const x = a[measure][i], y = b[measure][i];
    const kind = x === null ? (y === null ? 'neither' : 'only B') : y === null ? 'only A' : 'both';
    return { x: x ?? rim, y: y ?? rim, problem: figures.problems[i], job: kind === 'only A' ? b.job[i] : a.job[i], kind };
  }).filter((point) => point.x > 0 && point.y > 0);
}

/** One point of each kind for each square of 2 x 2 pixels: others would be drawn over it. */
function apart(all: Point[], pixel: (value: number) => number): Point[] {
  const kept = new Map<string, Point>();
  for (const point of all) {
    const place = `${Math.round(pixel(point.x) / 2)} ${Math.round(pixel(point.y) / 2)} ${point.kind}`;
    if (!kept.has(place)) kept.set(place, point);
  }
  return [...kept.values()];
}

function scatter(figures: ColumnFigures, measure: 'effort_ms' | 'cost', names: [string, string], unit: string, width: number, e: number): Element {
  const values = figures.methods.flatMap((m) => m[measure]).filter((v): v is number => v !== null && v > 0);
  const low = values.length > 0 ? Math.min(...values) * 0.8 : 1, high = values.length > 0 ? Math.max(...values) * 1.3 : 10, rim = high * 1.5;
  const all = points(figures, measure, rim), pixel = (value: number) => (width * Math.log(value / low)) / Math.log(rim / low);
  const links = all.length <= MOST_LINKS, data = links ? all : apart(all, pixel);
  const domain: [number, number] = [low, rim * 1.15];
  const rimmed = data.some((d) => d.kind !== 'both');
  const to = (d: Point) => (d.job === null ? null : href({ v: 'job', e: e || undefined, job: d.job, ghost: undefined, w: undefined }));
  const solved = colour(0), failed = failure();  // once: each call asks for the colour scheme
  const textOf = (d: Point) => `problem ${d.problem}, ${d.kind === 'both' ? `A ${number(d.x)}, B ${number(d.y)}` : `solved by ${d.kind}`}; click: the job`;
  const drawn = plot({
    width, height: Math.min(width, 420), marginLeft: 50, style: { color: ink(), background: 'transparent', fontSize: '11px' },
    x: { type: 'log', domain, label: `A: ${names[0]}, ${unit} \u2192`, grid: true, ticks: 5, tickFormat: '~g' },
    y: { type: 'log', domain, label: `\u2191 B: ${names[1]}, ${unit}`, grid: true, ticks: 5, tickFormat: '~g' },
    marks: [
      line([[low, low], [high, high]], { stroke: faint(), strokeDasharray: '4 3' }),
      ...(rimmed ? [ruleX([rim], { stroke: failure(), strokeOpacity: 0.4 }), ruleY([rim], { stroke: failure(), strokeOpacity: 0.4 }),
        textMark([{ x: low, y: rim }], { x: 'x', y: 'y', text: () => 'not solved by B', fill: failure(), textAnchor: 'start', dy: -7 })] : []),
      dot(data, { x: 'x', y: 'y', symbol: (d: Point) => (d.kind === 'both' ? 'circle' : 'times'), r: 3.6, strokeWidth: 1.6,
        stroke: (d: Point) => (d.kind === 'both' ? solved : failed), fill: (d: Point) => (d.kind === 'both' ? solved : 'none'), fillOpacity: 0.35,
        ...(links ? { href: to, title: textOf } : {}) }),
      tip(data, pointer({ x: 'x', y: 'y', title: textOf, maxRadius: 8 })),
    ],
    symbol: { type: 'identity' }, color: { type: 'identity' },
  });
  if (!links) drawn.style.cursor = 'pointer';
  if (!links) drawn.addEventListener('click', () => { const at = drawn.value as Point | null, address = at && to(at); if (address) location.hash = address; });
  return drawn;
}

function scatterRows(figures: ColumnFigures, measure: 'effort_ms' | 'cost'): (string | number | null)[][] {
  const [a, b] = figures.methods;
  return [['problem', 'a', 'b', 'job_a', 'job_b'], ...figures.problems.map((problem, i) => [problem, a[measure][i], b[measure][i], a.job[i], b.job[i]])];
}

function Verdict({ cell, e }: { cell: CellComparison; e: number }) {
  const { success, cost } = cell;
  const ratio = (r: Ratio, better: string) => (r.n > 0 ? <>{number(r.ratio)} {interval(r.interval)} on {r.n} problems, B {better} on {r.lower}; Wilcoxon {p(r.wilcoxon_p)}, adjusted {p(r.adjusted_p)}</> : DASH);
  const problem = (list: CellComparison['fastest']) => list.map((r, i) => (
    <span key={i}>{i > 0 && ', '}<a href={href({ v: 'job', e: e || undefined, job: r.job_b, ghost: r.job_a, w: undefined })}>{r.problem}</a> ({number(r.time_ratio)})</span>));
  return (
    <>
      <p class={`verdict ${cell.change}`}><strong>{VERDICTS[cell.change] ?? cell.change}.</strong></p>
      <table class="lines"><tbody>
        <tr><th scope="row">pairs</th><td>{cell.pairs}: both {cell.both}, only A {cell.only_a}, only B {cell.only_b}, neither {cell.neither}{cell.missing > 0 && `, missing ${cell.missing}`}</td></tr>
        <tr><th scope="row">success, B {DASH} A</th><td>{number(100 * success.difference)} % {interval(success.interval.map((v) => (v === null ? v : 100 * v)))}, {success.permutation_p === null ? <>McNemar mid-{p(success.mcnemar_mid_p)}</> : <>permutation {p(success.permutation_p)}</>}, adjusted {p(success.adjusted_p)}</td></tr>
        <tr><th scope="row">work, B / A</th><td>{ratio(cell.work, 'has less')}</td></tr>
        <tr><th scope="row">time, B / A</th><td>{ratio(cell.time, 'faster')}</td></tr>
        <tr><th scope="row">cost, B / A</th><td>{ratio(cost, 'cheaper')}</td></tr>
        <tr><th scope="row">PAR10</th><td>A {time(cell.par10_a_ms)}, B {time(cell.par10_b_ms)}; ratio {interval(cell.par10_ratio_interval)}</td></tr>
        <tr><th scope="row">runtimes</th><td>{RUNTIMES[cell.runtimes] ?? cell.runtimes}{cell.crossing_ms !== null && `, first at ${time(cell.crossing_ms)}`}</td></tr>
        {cell.fastest.length > 0 && <tr><th scope="row">B fastest beside A</th><td>problem {problem(cell.fastest)}</td></tr>}
        {cell.slowest.length > 0 && <tr><th scope="row">B slowest beside A</th><td>problem {problem(cell.slowest)}</td></tr>}
        {cell.contended_share > 0 && <tr><th scope="row">contended</th><td>{number(100 * cell.contended_share)} % of runs were disturbed by others</td></tr>}
      </tbody></table>
    </>
  );
}

function PairView({ pair, figures: pairFigures, e, eB, names, marks, caption, log, chosen }: { pair: Pair; figures: PairFigures | null; e: number; eB: number; names: [string, string]; marks: [number, number]; caption: string; log: boolean; chosen: number }) {
  if (pair.refused) return <p class="note">These two are not compared: {pair.refused}.</p>;
  if (!pairFigures) return null;
  const { report, cells } = pairFigures, { comparisons } = report;
  if (comparisons.length === 0) return <p class="note">No problem that both have finished.</p>;
  const i = Math.min(chosen, comparisons.length - 1), cell = comparisons[i], figures = cells[i];
  const title = (c: CellComparison) => `${c.task} from ${c.initialization.replace('_', ' ')}${comparisons.filter((o) => o.task === c.task && o.initialization === c.initialization).length > 1 ? `, ${c.method_a.name}` : ''}`;
  const both: [string, string] = [names[0] === names[1] ? `${names[0]} (A)` : names[0], names[0] === names[1] ? `${names[1]} (B)` : names[1]];
  const { label, less } = EFFORTS[figures.methods_effort];
  const depends = [pairFigures, i, log];
  const said = `${title(cell)}; n = ${cell.pairs} pairs, ${cell.both} solved by both. ${caption}`;
  return (
    <>
      <div class="bar"><label>Task and start: <select value={i} onChange={(x) => go({ k: x.currentTarget.value })}>
        {comparisons.map((c, k) => <option value={k} key={k}>{title(c)}: {VERDICTS[c.change] ?? c.change}</option>)}</select></label></div>
      <Verdict cell={cell} e={eB} />
      <div class="figures">
        <Figure name={`scatter-${figures.methods_effort}`} title={`${label[0].toUpperCase()}${label.slice(1)} by problem`} depends={depends} caption={`Below the line B ${less}. A click on a point leads to its job. ${said}`}
          draw={(width) => scatter(figures, 'effort_ms', both, `${label} in ms`, width, e)} rows={() => scatterRows(figures, 'effort_ms')} />
        <Figure name="scatter-cost" title="Costs by problem" depends={depends} caption={`Below the line B is cheaper. ${said}`}
          draw={(width) => scatter(figures, 'cost', both, 'cost', width, e)} rows={() => scatterRows(figures, 'cost')} />
      </div>
      <h3>The two alone</h3>
      <CurveSet name="pair" figures={figures} names={both.map((name, k) => ({ title: name, mark: marks[k] }))} pool="these two" caption={said} log={log} depends={depends} />
      {report.notes.length > 0 && <ul class="notes">{report.notes.map((note) => <li key={note}>{note}</li>)}</ul>}
      <p class="caption">p is adjusted by Holm over the comparisons of the list above. Rules: docs/explanation/statistics.md. With fewer than {report.least_discordant} problems that only one solves, no difference in success can be shown.</p>
    </>
  );
}

export function CompareView({ page, experiment, e, state }: { page: Page; experiment: Experiment; e: number; state: State }) {
  const log = state.lin === undefined, chosen = Number(state.k ?? 0);
  const across = state.x !== undefined ? page.across?.[Number(state.x)] : undefined;
  const a = Math.min(Number(state.a ?? 0), experiment.methods.length - 1);
  const b = Number(state.b ?? Math.min(a + 1, experiment.methods.length - 1));
  const [low, high] = a < b ? [a, b] : [b, a];
  const i = experiment.pairs.findIndex((one) => one.a === low && one.b === high), pair = experiment.pairs[i];
  const shown = across ?? pair, asked = shown && !shown.refused ? (across ? `across ${state.x}` : `${e} ${i}`) : null;
  const figures = useAnswer(String(asked), async () => (asked === null ? null : across ? ask('acrossPair', Number(state.x)) : ask('pair', e, i)), [page]);
  const select = (key: string, value: number) => (
    <select aria-label={key.toUpperCase()} value={value} onChange={(x) => go({ [key]: x.currentTarget.value, x: undefined })}>
      {experiment.methods.map((method, m) => <option value={m} key={m}>{method.choice}</option>)}</select>);
  return (
    <>
      <div class="bar">
        <label>A {select('a', low)}</label><label>B {select('b', high)}</label>
        {(page.across ?? []).map((one, i) => <a key={i} class="button" aria-current={across === one ? 'page' : undefined} href={href({ x: i, k: undefined })}>
          {page.experiments![one.a].name} ({page.experiments![one.a].id}) against {page.experiments![one.b].name} ({page.experiments![one.b].id})</a>)}
        <label><input type="checkbox" checked={log} onChange={() => go({ lin: log ? '1' : undefined }, true)} /> logarithmic curves</label>
      </div>
      {across ? <PairView pair={across} figures={figures} e={across.a} eB={across.b} names={[page.experiments![across.a].name, page.experiments![across.b].name]} marks={[0, 1]} log={log} chosen={chosen}
        caption={`A: ${captionOf(page.experiments![across.a])} B: ${captionOf(page.experiments![across.b])}`} />
        : low === high ? <p class="note">Choose two methods.</p>
        : pair ? <PairView pair={pair} figures={figures} e={e} eB={e} names={[experiment.methods[low].choice, experiment.methods[high].choice]} marks={[low, high]} caption={captionOf(experiment)} log={log} chosen={chosen} />
        : <p class="note">This file compares only the first method with each other one; 'legopt compare' compares any two.</p>}
    </>
  );
}
