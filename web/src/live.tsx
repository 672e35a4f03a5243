// Live status of a page sent by a server: progress, workers, failures.
import { useEffect, useRef, useState } from 'preact/hooks';
import { isLive, readPage, reasonOf, type Experiment, type Page } from './data';
import { href } from './state';
import { DASH, words } from './text';

export interface LiveExperiment {
  id: number; name: string; state: string; jobs: number; queued: number; leased: number; done: number; failed: number;
  dead: number; cancelled: number; solved: number; waiting_for: string; eta_s: number | null; per_minute: number;
}
export interface LiveState {
  version: number; source: string; rule: string; error?: string; experiments: LiveExperiment[];
  workers: { id: number; name: string; hostname: string; slots: number; leases: number; online: boolean | number; draining?: boolean | number; silent_s?: number | null; load: number | null; build_id: string | null }[];
  events?: { at_us: number; kind: string; experiment: number | null; job: number | null; worker: number | null; detail: string }[];
  failures: { job: number; experiment: number; method: string; task: string; initialization: string; problem: number; outcome: string; at_us: number }[];
}

/** State for tests: window.legopt. */
export const hooks: Record<string, unknown> = {};

const POLL_MS = 2000, RELOAD_MS = 5000;

/**
 * The state of the server, by its event stream, or by polling without one. `lost`: no answers arrive. A
 * hidden page makes no requests: browsers allow six connections to a host, for all tabs together.
 */
function useServer(): { live: LiveState | null; lost: boolean } {
  const [live, setLive] = useState<LiveState | null>(null), [lost, setLost] = useState(false);
  useEffect(() => {
    if (!isLive) return undefined;
    let stream: EventSource | null = null, timer = 0;
    const take = (text: string) => { setLive(JSON.parse(text) as LiveState); setLost(false); };
    const poll = async () => {
      try {
        const answer = await fetch('state', { cache: 'no-store' });
        if (!answer.ok) throw new Error(String(answer.status));
        take(await answer.text());
      } catch { setLost(true); }
      timer = window.setTimeout(poll, POLL_MS);
    };
    const stop = () => { stream?.close(); stream = null; clearTimeout(timer); };
    const begin = () => {
      stop();
      if (document.hidden) return;
      stream = new EventSource('events');
      stream.onmessage = (event) => take(event.data as string);
      stream.onerror = () => { stop(); poll(); };
    };
    begin();
    document.addEventListener('visibilitychange', begin);
    return () => { document.removeEventListener('visibilitychange', begin); stop(); };
  }, []);
  return { live, lost };
}

const finished = (e: LiveExperiment) => e.done + e.failed + e.dead + e.cancelled;

const ended = (e: Experiment) => e.jobs.length - e.unfinished;

/**
 * The page's figures, read again while they include fewer jobs than have ended: the server recomputes figures only
 * occasionally. Datasets are kept, so that nothing is loaded twice.
 */
export function useLive(first: Page): { page: Page; live: LiveState | null; lost: boolean; stale: string } {
  const [page, setPage] = useState(first), [asked, setAsked] = useState(0), [stale, setStale] = useState(''), { live, lost } = useServer();
  const timer = useRef(0);
  useEffect(() => {
    const old = page.experiments!.some((e) => {
      const now = live?.experiments?.find(({ id }) => id === e.id);
      return now !== undefined && (finished(now) !== ended(e) || (now.state === 'done' && e.state !== 'done'));
    });
    if (!old || timer.current) return;
    timer.current = window.setTimeout(async () => {
      const next = await readPage().catch((error) => reasonOf(error));
      timer.current = 0;
      setAsked(asked + 1);
      setStale(typeof next === 'string' ? next : '');
      if (typeof next === 'string') return;
      next.datasets = next.datasets.map((d) => page.datasets.find((known) => known.geometry.block === d.geometry.block) ?? d);
      hooks.page = next;
      setPage(next);
    }, RELOAD_MS);
  }, [live, page, asked]);
  return { page, live, lost, stale };
}

const duration = (s: number) => (s >= 5400 ? `${(s / 3600).toFixed(1)} h` : s >= 90 ? `${Math.round(s / 60)} min` : `${Math.round(s)} s`);

/** Text after a worker's name: its state, unless it is normal. */
function workerState(w: LiveState['workers'][number]): string {
  const heard = w.silent_s ? duration(w.silent_s) : null;
  if (!w.online) return heard ? ` (offline, heard ${heard} ago)` : ' (offline)';
  if (heard) return ` (silent for ${heard})`;
  return w.draining ? ' (draining)' : '';
}

function EventList({ events }: { events: NonNullable<LiveState['events']> }) {
  if (events.length === 0) return <p class="none">none</p>;
  return (
    <ul class="newest">{events.map((e, i) => (
      <li key={i}>{new Date(e.at_us / 1000).toLocaleTimeString([], { hour12: false })} <strong class={e.kind === 'experiment_finished' ? '' : 'bad'}>{words(e.kind)}</strong>
        {e.experiment !== null && `, experiment ${e.experiment}`}{e.job !== null && `, job ${e.job}`}{e.worker !== null && `, worker ${e.worker}`}{e.detail && `: ${e.detail}`}</li>))}</ul>
  );
}

/** One line above every view. */
export function LiveLine({ live, lost, stale, page }: { live: LiveState | null; lost: boolean; stale: string; page: Page }) {
  if (!isLive) return null;
  if (lost) return <p class="flagged" role="alert">The server of this page no longer answers. These data may be old.</p>;
  if (!live?.experiments) return <p class="says">waiting for the server</p>;
  const shown = live.experiments.filter((e) => page.experiments!.some(({ id }) => id === e.id));
  return (
    <div class="live" role="status">
      {live.error && <p class="flagged">{live.error}</p>}
      {stale && <p class="flagged" role="alert">The figures below are old, as newer ones cannot be loaded: {stale}</p>}
      {shown.map((e) => (
        <div key={e.id} class="bar">
          <progress max={e.jobs} value={finished(e)} aria-label={`jobs of experiment ${e.id}`} />
          <span class="says">{e.state}: {finished(e)} of {e.jobs} jobs, {e.solved} solved, {e.leased} running{e.per_minute > 0 ? `, ${e.per_minute} a minute` : ''}{e.eta_s !== null && e.state === 'active' ? `, about ${duration(e.eta_s)} left` : ''}{e.waiting_for ? `; waits: ${e.waiting_for}` : ''}</span>
        </div>))}
    </div>
  );
}

export function LiveView({ live, page }: { live: LiveState | null; page: Page }) {
  if (!live?.experiments) return <p class="none">Nothing has come yet.</p>;
  const shown = new Set(page.experiments!.map(({ id }) => id));
  return (
    <>
      <h3>Experiments of {live.source}</h3>
      <div class="scroll"><table class="lines"><thead><tr>{['experiment', 'state', 'jobs', 'ended', 'running', 'solved', 'failed or dead', 'a minute'].map((h) => <th scope="col" key={h}>{h}</th>)}</tr></thead>
        <tbody>{live.experiments.map((e) => (
          <tr key={e.id}><th scope="row"><a href={`?experiment=${e.id}${href({ v: undefined })}`} aria-current={shown.has(e.id) ? 'true' : undefined}>{e.id} {e.name}</a></th>
            <td>{e.state}</td><td>{e.jobs}</td><td>{finished(e)}</td><td>{e.leased}</td><td>{e.solved}</td><td>{e.failed + e.dead}</td><td>{e.per_minute}</td></tr>))}</tbody></table></div>
      <h3>Workers ({live.workers.length})</h3>
      {live.workers.length === 0 ? <p class="none">none at work</p>
        : <div class="scroll"><table class="lines"><thead><tr>{['worker', 'host', 'slots', 'jobs', 'load', 'build'].map((h) => <th scope="col" key={h}>{h}</th>)}</tr></thead>
          <tbody>{live.workers.map((w) => <tr key={w.id} class={w.online && !w.silent_s ? '' : 'bad'}><th scope="row">{w.name}{workerState(w)}</th><td>{w.hostname}</td><td>{w.slots}</td><td>{w.leases}</td><td>{w.load ?? DASH}</td><td>{w.build_id ?? DASH}</td></tr>)}</tbody></table></div>}
      {live.events && <><h3>Events</h3><EventList events={live.events} /></>}
      <h3>Newest jobs that are not solved, {live.rule} rule</h3>
      {live.failures.length === 0 ? <p class="none">none</p>
        : <ul class="newest">{live.failures.map((f) => (
          <li key={f.job}><a href={shown.has(f.experiment) ? href({ v: 'job', job: f.job, e: page.experiments!.findIndex(({ id }) => id === f.experiment) }) : `?experiment=${f.experiment}#v=job&job=${f.job}`}>job {f.job}</a>
            {' '}{new Date(f.at_us / 1000).toLocaleTimeString([], { hour12: false })} <strong class="bad">{words(f.outcome)}</strong>: {f.method}, {f.task} {f.problem} from {words(f.initialization)}</li>))}</ul>}
    </>
  );
}
