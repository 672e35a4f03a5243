// Filters and sorts jobs.
import { JobTable, type Rule } from './job_table';
import { MISSING, csv } from './text';

export const SORT_KEYS = ['job', 'method', 'column', 'problem', 'verdict', 'cost', 'cpu_us', 'iterations'] as const;
export type SortKey = (typeof SORT_KEYS)[number];

/** Filters and order of the list of jobs, from the address: method, column, outcome, text to find, order. */
export interface Choice { m?: string; c?: string; o?: string; q?: string; sort?: string }

function fits(jobs: JobTable, rule: Rule, choice: Choice, i: number): boolean {
  if (choice.m !== undefined && jobs.number('method', i) !== Number(choice.m)) return false;
  if (choice.c !== undefined && jobs.number('column', i) !== Number(choice.c)) return false;
  const verdict = jobs.verdict(rule, i);
  if (choice.o === 'unsolved' && (verdict === 'success' || MISSING.includes(verdict))) return false;
  if (choice.o === 'contended' && !jobs.contended(i)) return false;
  if (choice.o && !['all', 'unsolved', 'contended'].includes(choice.o) && verdict !== choice.o) return false;
  if (!choice.q) return true;
  const text = `${jobs.number('job', i)} ${jobs.number('problem', i)} ${verdict} ${jobs.text('status', i) ?? ''} ${jobs.text('detail', i) ?? ''}`;
  return text.toLowerCase().includes(choice.q.toLowerCase());
}

/** Indices of the chosen jobs in the chosen order; jobs without a value come last. */
export function select(jobs: JobTable, rule: Rule, choice: Choice): Uint32Array {
  const found: number[] = [];
  for (let i = 0; i < jobs.length; ++i) if (fits(jobs, rule, choice, i)) found.push(i);
  const key = SORT_KEYS.find((one) => one === choice.sort?.replace('-', '')) ?? 'job', sign = choice.sort?.startsWith('-') ? -1 : 1;
  const value = (i: number): number | string | null => (key === 'verdict' ? jobs.verdict(rule, i) : jobs.number(key, i));
  const values = found.map(value), order = Uint32Array.from(found.keys());
  order.sort((a, b) => {
    const x = values[a], y = values[b];
    if (x === null || y === null) return x === y ? 0 : x === null ? 1 : -1;
    return sign * (x < y ? -1 : x > y ? 1 : 0);
  });
  return order.map((k) => found[k]);
}

export function outcomesOf(jobs: JobTable, rule: Rule): string[] {
  const found = new Set<string>();
  for (let i = 0; i < jobs.length; ++i) found.add(jobs.verdict(rule, i));
  return [...found].sort();
}

/** Names that the jobs' indices stand for. */
export interface JobNames { rule: Rule; methods: { choice: string }[]; columns: { task: string; initialization: string }[] }

export function jobsCsv(jobs: JobTable, names: JobNames, order: Uint32Array): string {
  const rows = Array.from(order, (i) => {
    const job = jobs.row(i), { task, initialization } = names.columns[job.column];
    return [job.job, names.methods[job.method].choice, task, initialization, job.problem, job.repetition, jobs.verdict(names.rule, i),
      job.status, job.cost, job.wall_us, job.cpu_us, job.iterations, job.detail];
  });
  return csv([['job', 'method', 'task', 'initialization', 'problem', 'repetition', 'outcome', 'status', 'cost', 'wall_us', 'cpu_us', 'iterations', 'detail'], ...rows]);
}
