// All jobs, filtered and sorted; only the visible rows are drawn, so that 100,000 are fast.
import { useEffect, useMemo, useRef, useState } from 'preact/hooks';
import { holdsSolution, solveTime, type Experiment, type Jobs, type Page } from './data';
import { go, href, type State } from './state';
import { MISSING, csv, number, save, time, words } from './text';
import { captionOf } from './table';

const ROW = 28, MARGIN = 20;
const MOST_PRINTED = 5000;  // rows, some 100 sheets

/** Whether the page is being printed: paper does not scroll. */
function usePrinting(): boolean {
  const [printing, setPrinting] = useState(false);
  useEffect(() => {
    const begin = () => setPrinting(true), end = () => setPrinting(false);
    addEventListener('beforeprint', begin);
    addEventListener('afterprint', end);
    return () => { removeEventListener('beforeprint', begin); removeEventListener('afterprint', end); };
  }, []);
  return printing;
}

type Key = 'job' | 'method' | 'column' | 'problem' | 'verdict' | 'cost' | 'cpu_us' | 'iterations';
const HEADS: [Key, string][] = [['job', 'Job'], ['method', 'Method'], ['column', 'Task, start'], ['problem', 'Problem'], ['verdict', 'Outcome'], ['cost', 'Cost'], ['cpu_us', 'Time'], ['iterations', 'Iterations']];

export function verdictOf(jobs: Jobs, rule: Experiment['rule'], i: number): string {
  return jobs.state[i] === 'done' ? jobs[rule][i] ?? 'done' : jobs.state[i];
}

function selected(experiment: Experiment, state: State): number[] {
  const { jobs, rule } = experiment, query = (state.q ?? '').toLowerCase(), found: number[] = [];
  for (let i = 0; i < jobs.job.length; ++i) {
    if (state.m !== undefined && jobs.method[i] !== Number(state.m)) continue;
    if (state.c !== undefined && jobs.column[i] !== Number(state.c)) continue;
    const verdict = verdictOf(jobs, rule, i);
    if (state.o === 'unsolved' && (verdict === 'success' || MISSING.includes(verdict))) continue;
    if (state.o === 'contended' && !jobs.contended[i]) continue;
    if (state.o && !['all', 'unsolved', 'contended'].includes(state.o) && verdict !== state.o) continue;
    if (query && !`${jobs.job[i]} ${jobs.problem[i]} ${verdict} ${jobs.status[i] ?? ''} ${jobs.detail[i] ?? ''}`.toLowerCase().includes(query)) continue;
    found.push(i);
  }
  const key = (state.sort ?? 'job').replace('-', '') as Key, sign = state.sort?.startsWith('-') ? -1 : 1;
  const value = (i: number): number | string | null => (key === 'verdict' ? verdict(i) : jobs[key][i]);
  const verdict = (i: number) => verdictOf(jobs, rule, i);
  return found.sort((a, b) => {
    const x = value(a), y = value(b);
    if (x === null || y === null) return x === y ? 0 : x === null ? 1 : -1;
    return sign * (x < y ? -1 : x > y ? 1 : 0);
  });
}

export function JobsView({ page, experiment, e, state }: { page: Page; experiment: Experiment; e: number; state: State }) {
  const { jobs, rule } = experiment;
  const shown = useMemo(() => selected(experiment, state), [experiment, state.m, state.c, state.o, state.q, state.sort]);
  const outcomes = useMemo(() => [...new Set(jobs.job.map((_, i) => verdictOf(jobs, rule, i)))].sort(), [experiment]);
  const [top, setTop] = useState(0);
  const holder = useRef<HTMLDivElement>(null);
  useEffect(() => { holder.current?.scrollTo(0, 0); setTop(0); }, [shown]);
  const printing = usePrinting();
  const first = printing ? 0 : Math.max(0, Math.floor(top / ROW) - MARGIN), last = Math.min(shown.length, printing ? MOST_PRINTED : first + 2 * MARGIN + 30);
  const sort = (key: Key) => go({ sort: state.sort === key ? `-${key}` : key }, true);
  const rows = () => [['job', 'method', 'task', 'initialization', 'problem', 'repetition', 'outcome', 'status', 'cost', 'wall_us', 'cpu_us', 'iterations', 'detail'],
    ...shown.map((i) => [jobs.job[i], experiment.methods[jobs.method[i]].choice, experiment.columns[jobs.column[i]].task, experiment.columns[jobs.column[i]].initialization,
      jobs.problem[i], jobs.repetition[i], verdictOf(jobs, rule, i), jobs.status[i], jobs.cost[i], jobs.wall_us[i], jobs.cpu_us[i], jobs.iterations[i], jobs.detail[i]])];
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
        <span class="says">{shown.length} of {jobs.job.length} jobs <button onClick={() => save('jobs.csv', csv(rows()), 'text/csv')}>CSV</button></span>
      </div>
      <div class="jobs" ref={holder} onScroll={(x) => setTop(x.currentTarget.scrollTop)} tabIndex={0} role="region" aria-label="Jobs">
        <table aria-rowcount={shown.length}>
          <thead><tr>{HEADS.map(([key, head]) => (
            <th scope="col" key={key} aria-sort={state.sort === key ? 'ascending' : state.sort === `-${key}` ? 'descending' : 'none'}><button onClick={() => sort(key)}>{head}{state.sort === key ? ' \u25b4' : state.sort === `-${key}` ? ' \u25be' : ''}</button></th>))}
            <th scope="col">Detail</th></tr></thead>
          <tbody>
            {first > 0 && <tr style={{ height: `${first * ROW}px` }}><td colSpan={9} /></tr>}
            {shown.slice(first, last).map((i) => {
              const verdict = verdictOf(jobs, rule, i);
              return (
                <tr key={jobs.job[i]} class={verdict === 'success' || MISSING.includes(verdict) ? '' : 'bad'} style={{ height: `${ROW}px` }}>
                  <td><a class="job" href={href({ v: 'job', e: e || undefined, job: jobs.job[i], ghost: undefined, w: undefined })}>{jobs.job[i]}</a>
                    {holdsSolution(page, e, jobs.job[i]) ? '' : <span class="flag" title="this file does not hold its solution">no 3D</span>}</td>
                  <td>{experiment.methods[jobs.method[i]].choice}</td>
                  <td>{experiment.columns[jobs.column[i]].task}, {words(experiment.columns[jobs.column[i]].initialization)}</td>
                  <td>{jobs.problem[i]}{jobs.repetition[i] > 0 && <small> rep {jobs.repetition[i]}</small>}</td>
                  <td>{verdict === 'success' ? '\u2713 success' : MISSING.includes(verdict) ? `\u2026 ${words(verdict)}` : `\u2715 ${words(verdict)}`}</td>
                  <td>{number(jobs.cost[i])}</td>
                  <td>{jobs.wall_us[i] === null ? '\u2013' : time(solveTime(jobs.cpu_us[i], jobs.wall_us[i])! / 1e3)}{jobs.contended[i] && <span class="flag" title="others disturbed this run">c</span>}{jobs.status[i] === 'time_limit' && <span class="flag" title="limited by the clock: the solver was asked for its best point when its time was over">time limit</span>}</td>
                  <td>{number(jobs.iterations[i])}</td>
                  <td class="detail" title={jobs.detail[i] ?? ''}>{jobs.detail[i]}</td>
                </tr>);
            })}
            {last < shown.length && !printing && <tr style={{ height: `${(shown.length - last) * ROW}px` }}><td colSpan={9} /></tr>}
          </tbody>
        </table>
      </div>
      {printing && last < shown.length && <p class="note">{shown.length - last} of {shown.length} rows are not printed. Filter the jobs, or save all as CSV.</p>}
      <p class="caption">Times are wall times of whole solves; c: others disturbed the run. {captionOf(experiment)}</p>
    </>
  );
}
