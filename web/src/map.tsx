// Problems by methods: which were solved, how fast, at what cost; every field links to its job.
import type { Experiment } from './data';
import { ColumnChoice } from './curves';
import { go, href, type State } from './state';
import { DASH, csv, number, save } from './text';
import { captionOf } from './table';

const BINS = [1.0001, 1.25, 2, 5, 10];
const level = (ratio: number) => BINS.findIndex((bin) => ratio <= bin) + (ratio > BINS[BINS.length - 1] ? BINS.length + 1 : 0);

export function MapView({ experiment, e, state }: { experiment: Experiment; e: number; state: State }) {
  const c = Math.min(Number(state.c ?? 0), experiment.columns.length - 1), column = experiment.columns[c];
  const measure = state.by === 'cost' ? 'cost_ratio' : 'time_ratio';
  const rows = () => [['problem', ...experiment.methods.map((m) => m.title)], ...column.problems.map((problem, i) => [problem, ...column.methods.map((m) => m[measure][i])])];
  return (
    <>
      <div class="bar"><ColumnChoice experiment={experiment} state={state} />
        <label>Fields show: <select value={state.by ?? 'time'} onChange={(x) => go({ by: x.currentTarget.value })}>
          <option value="time">time / fastest</option><option value="cost">cost / cheapest</option></select></label>
        <span class="says"><span class="map-1">1</span> best, darker is worse; <span class="map-x">{'\u2715'}</span> not solved; {'\u2713'} solved, not yet by all methods tried; {'\u2026'} not finished; {DASH} not asked. A field leads to its job.</span></div>
      <div class="scroll"><table class="map">
        <thead><tr><th scope="col">Problem</th>{experiment.methods.map((method, m) => <th scope="col" key={m} title={method.title}>{method.choice.replace(/[:,]/g, '\n')}</th>)}</tr></thead>
        <tbody>{column.problems.map((problem, i) => (
          <tr key={problem}><th scope="row">{problem}</th>{column.methods.map((method, m) => {
            const ratio = method[measure][i], share = method.share[i], job = method.job[i];
            if (job === null) return <td key={m}>{DASH}</td>;
            const to = href({ v: 'job', e: e || undefined, job, ghost: undefined, w: undefined });
            const partly = share !== null && share > 0 && share < 1 ? `, solved in ${number(100 * share)} % of its runs` : '';
            if (ratio === null && share !== null && share > 0) {
              return <td key={m}><a href={to} aria-label={`problem ${problem}, ${experiment.methods[m].title}: solved, but not every method has finished it`}>{'\u2713'}</a></td>;
            }
            if (ratio === null) {
              return <td key={m} class={share === null ? '' : 'map-x'}><a href={to} aria-label={`problem ${problem}, ${experiment.methods[m].title}: ${share === null ? 'not finished' : 'not solved'}`}>{share === null ? '\u2026' : '\u2715'}</a></td>;
            }
            return <td key={m} class={`map-${level(ratio)}`}><a href={to} title={`problem ${problem}, ${experiment.methods[m].title}: ${number(ratio)} times the best${partly}`}>{number(ratio)}{partly && '*'}</a></td>;
          })}</tr>))}</tbody>
      </table></div>
      <p class="caption">{column.title}: ratios to the best of all methods on each problem, computed of solved runs. {captionOf(experiment)} <button onClick={() => save('map.csv', csv(rows()), 'text/csv')}>CSV</button></p>
    </>
  );
}
