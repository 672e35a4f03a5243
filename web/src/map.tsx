// Problems by methods: which were solved, how fast, at what cost; every field links to its job.
import { ask, useAnswer } from './background';
import type { ColumnFigures, Experiment } from './data';
import { ColumnChoice, EFFORTS } from './curves';
import { RowTable } from './rows';
import { go, href, type State } from './state';
import { DASH, csv, number, save } from './text';
import { captionOf } from './table';

const ROW_PX = 24;
const BINS = [1.0001, 1.25, 2, 5, 10];
const level = (ratio: number) => BINS.findIndex((bin) => ratio <= bin) + (ratio > BINS[BINS.length - 1] ? BINS.length + 1 : 0);

interface FieldProps { figures: ColumnFigures; measure: 'effort_ratio' | 'cost_ratio'; i: number; m: number; title: string; e: number }

function Field({ figures, measure, i, m, title, e }: FieldProps) {
  const method = figures.methods[m], ratio = method[measure][i], share = method.share[i], job = method.job[i];
  if (job === null) return <td>{DASH}</td>;
  const to = href({ v: 'job', e: e || undefined, job, ghost: undefined, w: undefined }), said = `problem ${figures.problems[i]}, ${title}`;
  const partly = share !== null && share > 0 && share < 1 ? `, solved in ${number(100 * share)} % of its runs` : '';
  if (ratio === null && share !== null && share > 0) {
    return <td><a href={to} aria-label={`${said}: solved, but not every method has finished it`}>{'\u2713'}</a></td>;
  }
  if (ratio === null) {
    return <td class={share === null ? '' : 'map-x'}><a href={to} aria-label={`${said}: ${share === null ? 'not finished' : 'not solved'}`}>{share === null ? '\u2026' : '\u2715'}</a></td>;
  }
  return <td class={`map-${level(ratio)}`}><a href={to} title={`${said}: ${number(ratio)} times the best${partly}`}>{number(ratio)}{partly && '*'}</a></td>;
}

export function MapView({ experiment, e, state }: { experiment: Experiment; e: number; state: State }) {
  const { methods } = experiment, c = Math.min(Number(state.c ?? 0), experiment.columns.length - 1), column = experiment.columns[c];
  const figures = useAnswer(`${e} ${c}`, () => ask('column', e, c), [experiment]);
  const { label, least } = EFFORTS[figures?.effort ?? 'work'];
  const measure = state.by === 'cost' ? 'cost_ratio' : 'effort_ratio';
  const rows = (of: ColumnFigures) => [['problem', ...methods.map((m) => m.title)], ...of.problems.map((problem, i) => [problem, ...of.methods.map((m) => m[measure][i])])];
  return (
    <>
      <div class="bar"><ColumnChoice experiment={experiment} state={state} />
        <label>Fields show: <select value={state.by === 'cost' ? 'cost' : 'effort'} onChange={(x) => go({ by: x.currentTarget.value })}>
          <option value="effort">{label} / {least}</option><option value="cost">cost / cheapest</option></select></label>
        <span class="says"><span class="map-1">1</span> best, darker is worse; <span class="map-x">{'\u2715'}</span> not solved; {'\u2713'} solved, not yet by all methods tried; {'\u2026'} not finished; {DASH} not asked. A field leads to its job.</span></div>
      {figures && <RowTable label="Problems" kind="map" noun="problems" hint="The CSV has all." count={figures.problems.length} height_px={ROW_PX} span={methods.length + 1} list={`${e} ${c}`}
        head={<tr><th scope="col">Problem</th>{methods.map((method, m) => <th scope="col" key={m} title={method.title}>{method.choice.replace(/[:,]/g, '\n')}</th>)}</tr>}
        row={(i) => (
          <tr aria-rowindex={i + 2} style={{ height: `${ROW_PX}px` }}><th scope="row">{figures.problems[i]}</th>
            {methods.map((method, m) => <Field key={m} figures={figures} measure={measure} i={i} m={m} title={method.title} e={e} />)}</tr>)} />}
      <p class="caption">{column.title}: ratios to the best of all methods on each problem, computed of solved runs. {captionOf(experiment)} {figures && <button onClick={() => save('map.csv', csv(rows(figures)), 'text/csv')}>CSV</button>}</p>
    </>
  );
}
