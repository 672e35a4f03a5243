// Entry point: reads the page's data and shows the view of the address.
import { render, type FunctionComponent } from 'preact';
import { useMemo } from 'preact/hooks';
import css from './page.css';
import { AboutView } from './about';
import { ErrorNote, pause, useAnswer } from './background';
import { isLive, readPage, type Experiment, type Page } from './data';
import { JobsView } from './jobs';
import { LiveLine, LiveView, hooks, useLive } from './live';
import { SiteView } from './site';
import { go, href, useAddress, type State } from './state';
import { subjectOf, viewSubject } from './subject';
import { TableView } from './table';

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
const FileView = lazily(async () => (await import('./file_view')).FileView);

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

function App({ page }: { page: Page }) {
  const state = useAddress();
  const subject = useMemo(() => (page.kind === 'view' ? viewSubject(page, state) : null), [state.job, state.rule]);
  if (page.kind === 'site') return <SiteView page={page} />;
  if (page.kind === 'viewer') return <FileView page={page} />;
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
