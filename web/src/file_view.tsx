// A file that the user opens: an archive, or a results database. Nothing is judged here, so its verdicts are claims.
import { useLayoutEffect, useMemo, useState } from 'preact/hooks';
import { ErrorNote } from './background';
import { openPage, reasonOf, type Dataset, type Experiment, type Page, type Solution } from './data';
import { JobsView } from './jobs';
import type { OpenedExperiment, OpenedFile, Opener } from './opened';
import { go, href, useAddress, type State } from './state';
import { FORMAT, type WholeExperiment, type WholePage } from './store';
import { subjectOf } from './subject';
import { MISSING, words } from './text';
import { Viewer } from './viewer';

const opener = () => (window as unknown as { legoptOpener: Opener }).legoptOpener;
const EMPTY = { limit_ms: 0, problems: [], methods: [], profiles: { effort: null, cost: null }, efforts: [], costs: [], causes: [] };

/** The shortest name that distinguishes a method from the others of its name. */
function choiceOf(method: OpenedExperiment['methods'][number], all: OpenedExperiment['methods']): string {
  const same = all.filter((other) => other.name === method.name), parts: string[] = [];
  for (const key of ['multi_starts', 'sample_size', 'incremental', 'collision'] as const) {
    if (same.some((other) => other[key] !== method[key])) parts.push(`${key}=${String(method[key])}`);
  }
  return parts.length > 0 ? `${method.name}:${parts.join(',')}` : method.name;
}

function wholeOf(experiment: OpenedExperiment, datasets: Dataset[]): WholeExperiment {
  const { id, name, dataset, rule, seed, repetitions, build_ids, methods, columns, jobs } = experiment;
  const index = datasets.findIndex((one) => one.hash === dataset.hash), ended = jobs.state.filter((state) => !['queued', 'leased'].includes(String(state))).length;
  return {
    place: '', id, name, state: 'done', unfinished: jobs.job.length - ended, dataset: { ...dataset, split: 'all' }, rule: rule as Experiment['rule'], seed, repetitions,
    submitted_utc: '', origin: '', build_ids, table: { rows: [], jobs: jobs.job.length, finished: ended, origins: [] }, statistics: { columns: [], rows: [] },
    methods: methods.map((method, i) => ({ ...method, id: i, title: method.name, choice: choiceOf(method, methods) })),
    columns: columns.map((column) => ({ ...column, title: `${words(column.task)}, ${words(column.initialization)}`, ...EMPTY })),
    pairs: [], jobs, outcomes: [], dataset_index: index < 0 ? null : index,
  } as unknown as WholeExperiment;
}

/** The numbers of a configuration: the degrees of freedom, then the pose of the base. */
const sizeOf = (dataset: Dataset) => dataset.robot.dofs.length + 7;

function solutionOf(file: OpenedFile, datasets: Dataset[], e: number, job: number): Solution | null {
  const experiment = file.experiments[e], dataset = datasets.find((one) => one.hash === experiment.dataset.hash), rows = experiment.solution(job);
  if (!dataset || rows.length === 0) return null;
  const size = sizeOf(dataset), stamped = rows.every((row) => row.length === size + 1), sound = stamped || rows.every((row) => row.length === size);
  return {
    experiment: e, job, waypoints: rows.length, encoding: 'f64', offset: 0, bytes: 0, trace: null, ...(sound ? {} : { malformed: true }),
    ...(stamped ? { times: rows.map((row) => row[size]) } : {}), x: sound ? rows.map((row) => Float64Array.from(row.slice(0, size))) : [],
  };
}

async function read(page: Page, name: string, bytes: Uint8Array): Promise<{ page: Page; file: OpenedFile }> {
  const file = await opener().read(name, bytes);
  const whole: WholePage = { format: FORMAT, kind: 'viewer', title: name, legopt: page.legopt, rule: file.experiments[0].rule, notes: [], version: 0, chunks: [], datasets: page.datasets, experiments: file.experiments.map((one) => wholeOf(one, page.datasets)) };
  return { file, page: await openPage(whole, (e, job) => solutionOf(file, page.datasets, e, job)) };
}

/** Counts of stored verdicts: solved of all jobs, by method and column. */
function Claims({ experiment, e }: { experiment: Experiment; e: number }) {
  const { jobs, rule, methods, columns } = experiment;
  const counts = useMemo(() => {
    const cells = methods.map(() => columns.map(() => ({ n: 0, solved: 0, missing: 0 })));
    for (let i = 0; i < jobs.length; ++i) {
      const cell = cells[jobs.number('method', i)!][jobs.number('column', i)!];
      ++cell.n;
      const verdict = jobs.verdict(rule, i);
      if (verdict === 'success') ++cell.solved;
      if (MISSING.includes(verdict)) ++cell.missing;
    }
    return cells;
  }, [experiment]);
  const jobsOf = (m: number, c: number, o: string) => href({ v: 'jobs', e: e || undefined, m, c, o, q: undefined });
  return (
    <div class="scroll"><table class="lines"><thead><tr><th scope="col">Method</th>{columns.map((column, c) => <th scope="col" key={c}>{column.title}</th>)}</tr></thead>
      <tbody>{methods.map((method, m) => <tr key={m}><th scope="row">{method.choice}</th>{columns.map((_, c) => {
        const { n, solved, missing } = counts[m][c], failed = n - solved - missing;
        return <td key={c}>{n > 0 && <><a href={jobsOf(m, c, 'all')}>{solved}/{n}</a>{failed > 0 && <> <a class="failed" href={jobsOf(m, c, 'unsolved')}>{failed} failed</a></>}{missing > 0 && ` ${missing} not finished`}</>}</td>;
      })}</tr>)}</tbody></table></div>
  );
}

const VIEWS: [string, string][] = [['table', 'Table'], ['jobs', 'Jobs'], ['about', 'Provenance']];

function OpenedView({ page, file, state }: { page: Page; file: OpenedFile; state: State }) {
  const experiments = page.experiments!, e = Math.min(Number(state.e ?? 0), experiments.length - 1), experiment = experiments[e], v = state.v ?? 'table';
  const subject = useMemo(() => (v === 'job' ? subjectOf(page, experiment, e, Number(state.job)) : null), [page, v, e, state.job]);
  return (
    <>
      <nav aria-label="Views">{VIEWS.map(([key, label]) => <a key={key} href={href({ v: key === 'table' ? undefined : key, job: undefined, m: undefined, c: undefined, o: undefined, q: undefined })} aria-current={v === key ? 'page' : undefined}>{label}</a>)}
        {v === 'job' && <a aria-current="page" href={location.hash}>Job {state.job}</a>}</nav>
      {experiments.length > 1 && <label class="bar">Experiment: <select value={e} onChange={(x) => go({ e: x.currentTarget.value, job: undefined, v: undefined })}>{experiments.map((one, i) => <option key={i} value={i}>{one.id} {one.name}</option>)}</select></label>}
      <p class="note">Nothing was judged here: verdicts and costs are those of the file, by the {experiment.rule} rule. <code>legopt archive judge</code> judges an archive.{experiment.dataset_index === null && ` The geometry of the dataset ${experiment.dataset.name} (${experiment.dataset.hash.slice(0, 12)}) is not on this page, so there is no 3D.`}</p>
      <main><ErrorNote view={location.hash}>
        {v === 'table' && <Claims experiment={experiment} e={e} />}
        {v === 'jobs' && <JobsView page={page} experiment={experiment} e={e} state={state} />}
        {v === 'about' && <table class="lines"><tbody>{file.facts.map(([name, value]) => <tr key={name}><th scope="row">{name}</th><td>{value}</td></tr>)}</tbody></table>}
        {v === 'job' && (typeof subject === 'string' ? <p class="note">{subject}</p> : subject && <Viewer page={page} subject={subject} state={state} />)}
      </ErrorNote></main>
    </>
  );
}

export function FileView({ page: empty }: { page: Page }) {
  const state = useAddress(), [open, setOpen] = useState<{ page: Page; file: OpenedFile } | null>(null), [says, setSays] = useState('');
  const take = async (file: File | undefined) => {
    if (!file) return;
    setSays(`Reading ${file.name}`);
    try {
      const next = await read(empty, file.name, new Uint8Array(await file.arrayBuffer()));
      location.hash = '';
      setOpen(next);
      setSays('');
    } catch (error) { setSays(`${file.name} cannot be read: ${reasonOf(error)}`); }
  };
  useLayoutEffect(() => {
    const over = (event: DragEvent) => event.preventDefault(), drop = (event: DragEvent) => { event.preventDefault(); void take(event.dataTransfer?.files[0]); };
    addEventListener('dragover', over);
    addEventListener('drop', drop);
    return () => { removeEventListener('dragover', over); removeEventListener('drop', drop); };
  }, []);
  return (
    <>
      <header><h1>{empty.home && <><a href={empty.home}>All archives</a> / </>}{open ? open.page.title : 'Open a file'}</h1>
        <div class="bar"><label>Drop an archive (.legopt-archive) or a results database (.sqlite) anywhere, or choose one: <input type="file" accept=".legopt-archive,.sqlite" onChange={(x) => take(x.currentTarget.files?.[0])} /></label>
          <span class="says">It stays on this machine.</span></div>
        {says && <p class="flagged" role="status">{says}</p>}</header>
      {open ? <OpenedView key={open.page.version} page={open.page} file={open.file} state={state} />
        : <p class="none">3D is available for {empty.datasets.map((one) => one.name).join(', ')}.</p>}
    </>
  );
}
