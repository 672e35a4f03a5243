// Subject of the 3D view: a job or a problem.
import { solveTime, type Experiment, type Page } from './data';
import type { State } from './state';
import { number, time, words } from './text';
import type { Subject } from './viewer';

/** A job of an experiment, or the reason why it cannot be shown. */
export function subjectOf(page: Page, experiment: Experiment, e: number, id: number): Subject | string {
  const { jobs, rule, methods, columns } = experiment, i = jobs.indexOf(id);
  if (i < 0) return `Experiment ${experiment.id} has no job ${id}.`;
  if (experiment.dataset_index === null) return 'The dataset was not at hand when this page was written: there is no 3D. Name its folder with --dataset.';
  const job = jobs.row(i), column = columns[job.column], method = methods[job.method];
  const others = jobs.ofProblem(job.problem).filter((k) => k !== i && columns[jobs.number('column', k)!].task === column.task).map((k) => {
    const other = jobs.row(k);
    return { job: other.job, label: `${other.job}: ${methods[other.method].choice}, ${words(columns[other.column].initialization)}, ${words(jobs.verdict(rule, k))}` };
  });
  const opened = page.kind === 'viewer';
  const facts: [string, string][] = [
    opened ? ['verdict of the file', `${words(jobs.verdict(rule, i))} (${rule} rule)`] : ['outcome, which counts', `${words(jobs.verdict(rule, i))} (judge, ${rule} rule)`], ['solver reported', `${words(job.status ?? 'nothing')}; this does not count: the judge evaluates the solution`],
    ['literal / strict / solid / physical', [job.literal, job.strict, job.solid, job.physical].map((v) => words(v ?? '\u2013')).join(' / ')],
    ...(job.detail ? [['judge', job.detail] as [string, string]] : []),
    ['cost, time', `${number(job.cost)}, ${job.wall_us === null ? '\u2013' : time(solveTime(job.cpu_us, job.wall_us)! / 1e3)}${job.contended ? ' (contended)' : ''}, ${number(job.iterations)} iterations, ${number(job.restarts)} restarts`],
  ];
  return { experiment: e, job: id, dataset: page.datasets[experiment.dataset_index], task: column.task, problem: job.problem, mark: job.method, others, facts, verdict: job.state === 'done' ? job[rule] : null, unjudged: opened,
    title: `Job ${id}: ${method.choice}, ${column.task} ${job.problem} from ${words(column.initialization)}` };
}

/** The job or problem of a page of `legopt view`. */
export function viewSubject(page: Page, state: State): Subject {
  const dataset = page.datasets[0];
  if (!page.jobs || page.jobs.length === 0) {
    const { task, id } = page.problem!;
    return { experiment: 0, job: null, dataset, task, problem: id, mark: 0, verdict: null, others: [], facts: [['dataset', `${dataset.name} (${dataset.hash.slice(0, 12)})`]], title: `${task} problem ${id}` };
  }
  const row = page.jobs.find((job) => job.job === Number(state.job)) ?? page.jobs[0], said = (key: string) => (row[key] === null ? '\u2013' : words(String(row[key])));
  const facts: [string, string][] = [
    ['verdicts, which count', `${['literal', 'strict', 'solid', 'physical'].map(said).join(' / ')} (judge, literal / strict / solid / physical rule)`], ['solver reported', `${said('status')}; this does not count: the judge evaluates the solution`],
    ...(row.detail ? [['judge', String(row.detail)] as [string, string]] : []),
    ['cost, time', `${number(row.cost as number | null)}, ${time(solveTime(row.cpu_us as number, row.wall_us as number)! / 1e3)}, ${said('iterations')} iterations`],
    ['experiment', `${row.experiment_id} '${row.experiment}', dataset ${row.dataset} (${String(row.dataset_hash).slice(0, 12)}), seed ${row.seed}, build ${row.build_id}`],
  ];
  const rule = state.rule ?? (row.rule ? String(row.rule) : 'literal');  // older files do not name the experiment's rule
  return { experiment: 0, job: row.job as number, dataset, task: String(row.task), problem: row.problem as number, mark: 0, facts, rule, verdict: row[rule] === null ? null : String(row[rule]),
    others: page.jobs.filter((other) => other !== row).map((other) => ({ job: other.job as number, label: `${other.job}: ${other.method}` })),
    title: `Job ${row.job}: ${row.method}, ${row.task} ${row.problem} from ${words(String(row.initialization))}` };
}
