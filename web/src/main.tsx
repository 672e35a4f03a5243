// Entry point: reads the page's data and shows the view of the address.
import { render, type FunctionComponent } from 'preact';
import { useMemo } from 'preact/hooks';
import css from './page.css';
import { AboutView } from './about';
import { ErrorNote, pause, useAnswer } from './background';
import { isLive, readPage, solveTime, type Experiment, type Page } from './data';
import { JobsView } from './jobs';
import { LiveLine, LiveView, hooks, useLive } from './live';
import { SiteView } from './site';
import { go, href, useAddress, type State } from './state';
import { TableView } from './table';
import { number, time, words } from './text';
import type { Subject } from './viewer';

const VIEWS: [string, string][] = [['table', 'Table'], ['profiles', 'Profiles'], ['compare', 'Compare'], ['map', 'Problems'], ['jobs', 'Jobs'], ['about', 'Provenance'], ...(isLive ? [['live', 'Live'] as [string, string]] : [])];

/** A view whose program starts when it is first shown: that of drawings takes long. */
function lazily<Props extends object>(load: () => Promise<FunctionComponent<Props>>): FunctionComponent<Props> {
  return (props) => {
    const loaded = useAnswer('', async () => {
      const View = await load();
      await pause();
      return { View };
    }, []);
    return loaded && <loaded.View {...props} />;
  };
}

const ProfileView = lazily(async () => (await import('./curves')).ProfileView);
const CompareView = lazily(async () => (await import('./compare')).CompareView);
const MapView = lazily(async () => (await import('./map')).MapView);
const Viewer = lazily(async () => (await import('./viewer')).Viewer);

function subjectOf(page: Page, experiment: Experiment, e: number, id: number): Subject | string {
  const { jobs, rule, methods, columns } = experiment, i = jobs.indexOf(id);
  if (i < 0) return `Experiment ${experiment.id} has no job ${id}.`;
  if (experiment.dataset_index === null) return 'The dataset was not at hand when this page was written: there is no 3D. Name its folder with --dataset.';
  const job = jobs.row(i), column = columns[job.column], method = methods[job.method];
  const others = jobs.ofProblem(job.problem).filter((k) => k !== i && columns[jobs.number('column', k)!].task === column.task).map((k) => {
    const other = jobs.row(k);
    return { job: other.job, label: `${other.job}: ${methods[other.method].choice}, ${words(columns[other.column].initialization)}, ${words(jobs.verdict(rule, k))}` };
  });
  const facts: [string, string][] = [
    ['outcome, which counts', `${words(jobs.verdict(rule, i))} (judge, ${rule} rule)`], ['solver reported', `${words(job.status ?? 'nothing')}; this does not count: the judge evaluates the solution`],
    ['literal / strict / solid / physical', [job.literal, job.strict, job.solid, job.physical].map((v) => words(v ?? '\u2013')).join(' / ')],
    ...(job.detail ? [['judge', job.detail] as [string, string]] : []),
    ['cost, time', `${number(job.cost)}, ${job.wall_us === null ? '\u2013' : time(solveTime(job.cpu_us, job.wall_us)! / 1e3)}${job.contended ? ' (contended)' : ''}, ${number(job.iterations)} iterations, ${number(job.restarts)} restarts`],
  ];
  return { experiment: e, job: id, dataset: page.datasets[experiment.dataset_index], task: column.task, problem: job.problem, mark: job.method, others, facts, verdict: job.state === 'done' ? job[rule] : null,
    title: `Job ${id}: ${method.choice}, ${column.task} ${job.problem} from ${words(column.initialization)}` };
}

const stateOf = ({ jobs }: Experiment, job: number) => jobs.text('state', jobs.indexOf(job));

function Report({ page: first, state }: { page: Page; state: State }) {
  const { page, live, lost, stale } = useLive(first);
  const experiments = page.experiments!, e = Math.min(Number(state.e ?? 0), experiments.length - 1), experiment = experiments[e], v = state.v ?? 'table';
  const subject = useMemo(() => (v === 'job' ? subjectOf(page, experiment, e, Number(state.job)) : null), [v, e, state.job, v === 'job' && stateOf(experiment, Number(state.job))]);
  const unfinished = experiments.filter((one) => one.unfinished > 0);
  return (
    <>
      <header>
        <h1>{page.home && <><a href={page.home}>All archives</a> / </>}{page.title} <span class="setting">{experiment.dataset.name}, {experiment.rule} rule</span></h1>
        <nav aria-label="Views">{VIEWS.map(([key, label]) => <a key={key} href={href({ v: key === 'table' ? undefined : key, job: undefined, ghost: undefined, w: undefined, ...(key === 'jobs' ? { o: undefined, q: undefined, m: undefined, c: undefined } : {}) })} aria-current={v === key ? 'page' : undefined}>{label}</a>)}
          {v === 'job' && <a aria-current="page" href={location.hash}>Job {state.job}</a>}</nav>
        {experiments.length > 1 && v !== 'table' && <label class="bar">Experiment: <select value={e} onChange={(x) => go({ e: x.currentTarget.value })}>
          {experiments.map((one, i) => <option key={i} value={i}>{one.id} {one.name}{one.place && `, ${one.place}`}</option>)}</select></label>}
        <LiveLine live={live} lost={lost} stale={stale} page={page} />
      </header>
      {unfinished.length > 0 && <p class="flagged" role="status">UNFINISHED: {unfinished.map((one) => `experiment ${one.id} has ${one.unfinished} jobs without an end`).join('; ')}. Every figure is of the rest.</p>}
      <main><ErrorNote view={location.hash}>
        {v === 'table' && <TableView experiments={experiments} state={state} />}
        {v === 'profiles' && <ProfileView experiment={experiment} state={state} />}
        {v === 'compare' && <CompareView page={page} experiment={experiment} e={e} state={state} />}
        {v === 'map' && <MapView experiment={experiment} e={e} state={state} />}
        {v === 'jobs' && <JobsView page={page} experiment={experiment} e={e} state={state} />}
        {v === 'about' && <AboutView page={page} experiment={experiment} state={state} />}
        {v === 'live' && <LiveView live={live} page={page} />}
        {v === 'job' && (typeof subject === 'string' ? <p class="note">{subject}</p> : subject && <Viewer page={page} subject={subject} state={state} />)}
      </ErrorNote></main>
      {page.notes.length > 0 && <footer><ul class="notes">{page.notes.map((note) => <li key={note}>{note}</li>)}</ul></footer>}
    </>
  );
}

function viewSubject(page: Page, state: State): Subject {
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

function App({ page }: { page: Page }) {
  const state = useAddress();
  const subject = useMemo(() => (page.kind === 'view' ? viewSubject(page, state) : null), [state.job, state.rule]);
  if (page.kind === 'site') return <SiteView page={page} />;
  return subject ? <main class="alone"><ErrorNote view={location.hash}><Viewer page={page} subject={subject} state={state} /></ErrorNote></main> : <Report page={page} state={state} />;
}

const style = document.createElement('style');
style.textContent = css;
document.head.append(style);
const app = document.getElementById('app')!;
(window as unknown as { legopt: unknown }).legopt = hooks;
const begin = () => readPage().then((page) => {
  hooks.page = page;
  hooks.poseError = async () => Math.max(0, ...page.datasets.map((await import('./motion')).checkPoses));
  hooks.jobs = (e: number) => { const { jobs } = (hooks.page as Page).experiments![e]; return Array.from({ length: jobs.length }, (_, i) => jobs.row(i)); };
  app.replaceChildren();
  render(<App page={page} />, app);
}).catch((error) => { app.textContent = `This page cannot be read: ${error instanceof Error ? error.message : error}`; });
setTimeout(begin);  // a task of its own: the start is not one long task
