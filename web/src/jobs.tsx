// All jobs, filtered and sorted.
import { ask, useAnswer } from './background';
import { holdsSolution, solveTime, type Experiment, type Page } from './data';
import type { SortKey } from './job_selection';
import { RowTable } from './rows';
import { go, href, type State } from './state';
import { MISSING, number, save, time, words } from './text';
import { captionOf } from './table';

const ROW_PX = 28;
const HEADS: [SortKey, string][] = [['job', 'Job'], ['method', 'Method'], ['column', 'Task, start'], ['problem', 'Problem'], ['verdict', 'Outcome'], ['cost', 'Cost'], ['cpu_us', 'Time'], ['iterations', 'Iterations']];

/** Indices of the chosen jobs of experiment `e`; the former ones until the new ones are found. */
function useSelected(page: Page, e: number, { m, c, o, q, sort }: State): Uint32Array | null {
  return useAnswer(String(e), async (former: Uint32Array | null) => (await ask('jobs', page.version, e, { m, c, o, q, sort })) ?? former, [page.version, m, c, o, q, sort]);
}

export function JobsView({ page, experiment, e, state }: { page: Page; experiment: Experiment; e: number; state: State }) {
  const { jobs, rule, outcomes } = experiment, shown = useSelected(page, e, state);
  const { m, c, o, q, sort: order } = state;
  const sort = (key: SortKey) => go({ sort: state.sort === key ? `-${key}` : key }, true);
  const saveAll = async (chosen: Uint32Array) => save('jobs.csv', await ask('jobsCsv', e, chosen), 'text/csv');
  const row = (chosen: Uint32Array, k: number) => {
    const job = jobs.row(chosen[k]), verdict = jobs.verdict(rule, chosen[k]), column = experiment.columns[job.column];
    return (
      <tr aria-rowindex={k + 2} class={verdict === 'success' || MISSING.includes(verdict) ? '' : 'bad'} style={{ height: `${ROW_PX}px` }}>
        <td><a class="job" href={href({ v: 'job', e: e || undefined, job: job.job, ghost: undefined, w: undefined })}>{job.job}</a>
          {holdsSolution(page, e, job.job) ? '' : <span class="flag" title="this file does not hold its solution">no 3D</span>}</td>
        <td>{experiment.methods[job.method].choice}</td>
        <td>{column.task}, {words(column.initialization)}</td>
        <td>{job.problem}{job.repetition > 0 && <small> rep {job.repetition}</small>}</td>
        <td>{verdict === 'success' ? '\u2713 success' : MISSING.includes(verdict) ? `\u2026 ${words(verdict)}` : `\u2715 ${words(verdict)}`}</td>
        <td>{number(job.cost)}</td>
        <td>{job.wall_us === null ? '\u2013' : time(solveTime(job.cpu_us, job.wall_us)! / 1e3)}{job.contended && <span class="flag" title="others disturbed this run">c</span>}{job.status === 'time_limit' && <span class="flag" title="limited by the clock: the solver was asked for its best point when its time was over">time limit</span>}</td>
        <td>{number(job.iterations)}</td>
        <td class="detail" title={job.detail ?? ''}>{job.detail}</td>
      </tr>);
  };
  return (
    <>
      <div class="bar">
        <label>Method <select value={state.m ?? ''} onChange={(x) => go({ m: x.currentTarget.value || undefined }, true)}><option value="">all</option>
          {experiment.methods.map((method, m) => <option value={m} key={m}>{method.choice}</option>)}</select></label>
        <label>Task, start <select value={state.c ?? ''} onChange={(x) => go({ c: x.currentTarget.value || undefined }, true)}><option value="">all</option>
          {experiment.columns.map((column, c) => <option value={c} key={c}>{column.title}</option>)}</select></label>
        <label>Outcome <select value={state.o ?? 'all'} onChange={(x) => go({ o: x.currentTarget.value }, true)}>
          {['all', 'unsolved', 'contended', ...outcomes].map((o) => <option value={o} key={o}>{words(o)}</option>)}</select></label>
        <label>Find <input type="search" value={state.q ?? ''} placeholder="id, word of the detail" onInput={(x) => go({ q: x.currentTarget.value || undefined }, true)} /></label>
        {shown && <span class="says">{shown.length} of {jobs.length} jobs <button onClick={() => saveAll(shown)}>CSV</button></span>}
      </div>
      {shown && <RowTable label="Jobs" kind="jobs" noun="jobs" hint="Filter them, or save all as CSV." count={shown.length} height_px={ROW_PX} span={HEADS.length + 1} list={[e, m, c, o, q, order].join(' ')} row={(k) => row(shown, k)}
        head={<tr>{HEADS.map(([key, head]) => (
          <th scope="col" key={key} aria-sort={state.sort === key ? 'ascending' : state.sort === `-${key}` ? 'descending' : 'none'}><button onClick={() => sort(key)}>{head}{state.sort === key ? ' \u25b4' : state.sort === `-${key}` ? ' \u25be' : ''}</button></th>))}
          <th scope="col">Detail</th></tr>} />}
      <p class="caption">Times are CPU times of whole solves; c: others disturbed the run. {captionOf(experiment)}</p>
    </>
  );
}
