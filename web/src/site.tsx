// The website of a folder of archives: leaderboards of the tiers, problems, archives (legopt archive site).
import { ErrorNote } from './background';
import type { Page } from './data';
import { colour } from './marks';
import { RowTable } from './rows';
import { go, href, useAddress, type State } from './state';
import { DASH, INFINITY, csv, number, save, time, words } from './text';

/** The problems of a cell, as columns; null: unknown or, for `verdict` and `job`, not in the archive. */
interface Problems { share: number[]; cost: (number | null)[]; work_ms: (number | null)[]; cpu_ms: (number | null)[]; verdict: (string | null)[]; job: (number | null)[] }
interface Cell {
  solved: number; given: number; lower: number; upper: number; cost_median: number | null; work_median_ms: number | null;
  cpu_median_ms: number | null; column: number; problems: Problems;
}
interface Row { entry: number; method: number; name: string; multi_starts: number; sample_size: number; cells: Record<string, Cell | null> }
interface Board { tier: number; rule: string; dataset: string; hash: string; task: string; problems: number[]; rows: Row[] }
interface Tier { id: string; title: string; question: string; rule: string; infeasible: boolean }
interface Entry {
  name: string; hash: string; title: string; authors: string[]; paper: string; licence: string; code: string; notes: string; experiment: string;
  dataset: string; dataset_hash: string; seed: number; repetitions: number; jobs: number; results: number; differing: number;
  builds: { id: string; text: string; processor: string }[];
}
export interface Site { edition: string; about: string; tiers: Tier[]; entries: Entry[]; boards: Board[] }

const INITIALIZATIONS: [string, string][] = [['good', 'good initial guesses'], ['in_collision', 'initial guesses in collision']];
const ROW_PX = 24;

const entryPage = (entry: Entry) => `archives/${encodeURIComponent(entry.name)}.html`;
const jobPage = (entry: Entry, job: number) => `${entryPage(entry)}#v=job&job=${job}`;
const rowTitle = (row: Row) => `${row.name}${row.multi_starts > 0 ? ` ${row.multi_starts}\u00d7` : ''}${row.sample_size < 100 ? ` ${row.sample_size} %` : ''}`;
const boardTitle = ({ dataset, task }: Board) => `${dataset}, ${task}`;
/** A sum of shares: a whole number without repetitions. */
const count = (value: number) => (Number.isInteger(value) ? String(value) : number(value));
const percent = (share: number) => (100 * share).toFixed(share === 0 || share === 1 ? 0 : 1);

function Solved({ cell, board, entry, tier, row }: { cell: Cell; board: Board; entry: Entry; tier: Tier; row: Row }) {
  const n = board.problems.length, to = (only: string) => `${entryPage(entry)}#v=jobs&m=${row.method}&c=${cell.column}&o=${only}`;
  return (
    <>
      <td class="count"><a href={to('all')}>{count(cell.solved)}/{n}</a>
        {cell.given < n && <span class="flag" title="problems that the archive has; the others are not solved">{cell.given} given</span>}
        {tier.infeasible && cell.solved > 0 && <span class="flag">should be 0</span>}</td>
      <td><span class="interval" title={`95 % interval (Wilson) over ${n} problems`}>
        <svg width="56" height="9" aria-hidden="true"><line x1="1" x2="55" y1="4.5" y2="4.5" class="track" />
          <line x1={1 + 54 * cell.lower} x2={1 + 54 * cell.upper} y1="4.5" y2="4.5" stroke={colour(0)} stroke-width="3" /></svg>
        {percent(cell.lower)}{DASH}{percent(cell.upper)}</span></td>
      <td>{cell.solved < cell.given && <a class="failed" href={to('unsolved')} aria-label={`problems that ${row.name} did not solve`}>{count(cell.given - cell.solved)} failed</a>}</td>
      <td class="figure-cell">{cell.cost_median === null ? INFINITY : number(cell.cost_median)}</td>
    </>
  );
}

/** A median: infinite if at most half of the problems were solved; else it can be unknown. */
function claimed(value: number | null, { problems: { share } }: Cell): string {
  if (value !== null) return time(value);
  return 2 * share.filter((one) => one > 0).length <= share.length ? INFINITY : DASH;
}

function BoardTable({ site, b }: { site: Site; b: number }) {
  const board = site.boards[b], tier = site.tiers[board.tier], n = board.problems.length;
  const initializations = INITIALIZATIONS.filter(([key]) => board.rows.some((row) => row.cells[key]));
  return (
    <section data-board={b}>
      <h3>{boardTitle(board)} <span class="setting">{n} problems, <a href={href({ v: 'problems', b, p: undefined }, {})}>each problem</a></span></h3>
      <div class="scroll"><table class="scores board">
        <thead>
          <tr><th colSpan={3} />{initializations.map(([key, label]) => <th scope="colgroup" key={key} colSpan={4}>{label}, judged here</th>)}<th scope="colgroup" colSpan={2 * initializations.length}>claimed by the archive</th></tr>
          <tr><th scope="col">#</th><th scope="col">Method</th><th scope="col">Archive</th>
            {initializations.map(([key]) => [<th scope="col" key={`${key}s`}>Solved {'\u2191'}</th>, <th scope="col" key={`${key}i`}>95 % interval</th>, <th scope="col" key={`${key}f`} />,
              <th scope="col" key={`${key}c`} class="figure-cell" title="median over all problems, unsolved ones infinite">Cost {'\u2193'}</th>])}
            {initializations.map(([key, label]) => [<th scope="col" key={`${key}w`} class="figure-cell" title={`median of weighted term evaluations over all problems, ${label}`}>Work {'\u2193'}</th>,
              <th scope="col" key={`${key}t`} class="figure-cell" title={`median CPU time on the archive's own machine, ${label}`}>CPU time</th>])}</tr>
        </thead>
        <tbody>{board.rows.map((row, r) => {
          const entry = site.entries[row.entry];
          return (
            <tr key={r}><td>{r + 1}</td><th scope="row">{rowTitle(row)}</th>
              <td><a href={entryPage(entry)}>{entry.name}</a>{entry.differing > 0 && <span class="flag" title="results whose verdict or cost is another one than the archive states">{entry.differing} claims differ</span>}</td>
              {initializations.map(([key]) => { const cell = row.cells[key]; return cell ? <Solved key={key} {...{ cell, board, entry, tier, row }} /> : <td key={key} colSpan={4}>{DASH}</td>; })}
              {initializations.map(([key]) => { const cell = row.cells[key]; return [<td key={`${key}w`} class="figure-cell">{cell ? claimed(cell.work_median_ms, cell) : DASH}</td>, <td key={`${key}t`} class="figure-cell">{cell ? claimed(cell.cpu_median_ms, cell) : DASH}</td>]; })}
            </tr>);
        })}</tbody>
      </table></div>
    </section>
  );
}

function Tiers({ site }: { site: Site }) {
  return (
    <>
      <p class="says">{site.about}</p>
      {site.tiers.map((tier, t) => {
        const boards = site.boards.map((board, b) => ({ board, b })).filter(({ board }) => board.tier === t);
        const empty = boards.filter(({ board }) => board.rows.length === 0);
        return (
          <section key={tier.id} id={tier.id} data-tier={tier.id}>
            <h2>{tier.title} <span class="setting">{tier.rule} rule{tier.infeasible && ', infeasible'}</span></h2>
            <p class="says">{tier.question}</p>
            {boards.filter(({ board }) => board.rows.length > 0).map(({ b }) => <BoardTable key={b} site={site} b={b} />)}
            {empty.length > 0 && <p class="none">No archive yet: {empty.map(({ board }) => boardTitle(board)).join('; ')}.</p>}
          </section>
        );
      })}
      <p class="caption">Solved: by the tier's rule, of all problems of the dataset; repetitions of one problem are averaged. Rows are ordered by the share of solved problems, averaged over the initial guesses, then by cost. Medians are over all problems, unsolved ones at infinity. Verdicts and costs were computed here; work and CPU time were not measured here, and CPU times of different machines cannot be compared.</p>
    </>
  );
}

/** Columns of a table of problems: the rows of a board from each initial guess. */
const columnsOf = (board: Board) => INITIALIZATIONS.flatMap(([key, label]) => board.rows.filter((row) => row.cells[key]).map((row) => ({ row, cell: row.cells[key]!, label })));

function ProblemsView({ site, b }: { site: Site; b: number }) {
  const board = site.boards[b], columns = columnsOf(board);
  const mark = (share: number) => (share === 1 ? '\u2713' : share === 0 ? '\u2715' : `${percent(share)} %`);
  const rows = () => [['problem', ...columns.map(({ row, label }) => `${rowTitle(row)}, ${site.entries[row.entry].name}, ${label}`)], ...board.problems.map((id, i) => [id, ...columns.map(({ cell }) => cell.problems.share[i])])];
  return (
    <>
      <h2>{site.tiers[board.tier].title}: {boardTitle(board)}</h2>
      <RowTable label="Problems" kind="map" noun="problems" hint="The CSV has all." count={board.problems.length} height_px={ROW_PX} span={columns.length + 1} list={b}
        head={<tr><th scope="col">Problem</th>{columns.map(({ row, label }, k) => <th scope="col" key={k} title={`${site.entries[row.entry].name}, ${label}`}>{`${rowTitle(row)}\n${label.replace('initial guesses', '').trim()}`}</th>)}</tr>}
        row={(i) => (
          <tr aria-rowindex={i + 2} style={{ height: `${ROW_PX}px` }}><th scope="row"><a href={href({ p: i })}>{board.problems[i]}</a></th>
            {columns.map(({ row, cell }, k) => {
              const job = cell.problems.job[i], share = cell.problems.share[i];
              return <td key={k} class={share === 0 ? 'map-x' : 'map-1'}>{job === null ? DASH : <a href={jobPage(site.entries[row.entry], job)}>{mark(share)}</a>}</td>;
            })}</tr>)} />
      <p class="caption">{'\u2713'} solved, {'\u2715'} not solved, {DASH} not in the archive. A field leads to the solution in 3D. <button onClick={() => save('problems.csv', csv(rows()), 'text/csv')}>CSV</button></p>
    </>
  );
}

function ProblemView({ site, b, i }: { site: Site; b: number; i: number }) {
  const board = site.boards[b], columns = columnsOf(board);
  const solved = columns.filter(({ cell }) => cell.problems.share[i] > 0), costs = solved.map(({ cell }) => cell.problems.cost[i]!).filter((cost) => cost !== null);
  const go_to = (step: number) => href({ p: i + step });
  return (
    <>
      <h2>Problem {board.problems[i]} <span class="setting">{site.tiers[board.tier].title}, <a href={href({ p: undefined })}>{boardTitle(board)}</a></span></h2>
      <div class="bar">{i > 0 && <a href={go_to(-1)}>previous</a>}{i + 1 < board.problems.length && <a href={go_to(1)}>next</a>}
        <span class="says">{solved.length} of {columns.length} rows solved it{costs.length > 0 && `; lowest cost ${number(Math.min(...costs))}`}</span></div>
      <div class="scroll"><table class="lines"><thead><tr>{['Method', 'Archive', 'Initial guess', 'Outcome', 'Cost', 'Work, claimed', 'CPU time, claimed', ''].map((h) => <th scope="col" key={h}>{h}</th>)}</tr></thead>
        <tbody>{columns.map(({ row, cell, label }, k) => {
          const { share, cost, work_ms, cpu_ms, verdict, job } = cell.problems, entry = site.entries[row.entry];
          return (
            <tr key={k} class={share[i] > 0 ? '' : 'bad'}><th scope="row">{rowTitle(row)}</th><td><a href={entryPage(entry)}>{entry.name}</a></td><td>{label}</td>
              <td>{job[i] === null ? 'not in the archive' : verdict[i] === null ? 'no result' : words(verdict[i]!)}{share[i] > 0 && share[i] < 1 && ` (${percent(share[i])} % of the runs solved it)`}</td>
              <td>{number(cost[i])}</td><td>{time(work_ms[i])}</td><td>{time(cpu_ms[i])}</td>
              <td>{job[i] !== null && <a href={jobPage(entry, job[i]!)}>3D</a>}</td></tr>);
        })}</tbody></table></div>
    </>
  );
}

const link = (text: string) => (/^https?:\/\//.test(text) ? <a href={text} rel="noreferrer">{text}</a> : text);

function EntriesView({ site }: { site: Site }) {
  return (
    <>
      {site.entries.map((entry) => {
        const facts: [string, preact.ComponentChildren][] = [
          ['authors', entry.authors.join(', ')], ['paper', link(entry.paper)], ['code', link(entry.code)], ['licence', entry.licence], ['notes', entry.notes],
          ['results', `${entry.results} of ${entry.jobs} jobs, experiment '${entry.experiment}', seed ${entry.seed}, ${entry.repetitions === 1 ? 'one run' : `${entry.repetitions} runs`} per problem`],
          ['dataset', `${entry.dataset} (${entry.dataset_hash.slice(0, 12)})`],
          ['judged here', entry.differing === 0 ? 'every verdict and cost is the one that the archive states' : `${entry.differing} results have another verdict or cost than the archive states`],
          ['made by', entry.builds.map((build) => `build ${build.id} (${build.text}) on ${build.processor}`).join('; ')],
          ['hash', entry.hash]];
        return (
          <section key={entry.name}>
            <h2>{entry.title || entry.name}</h2>
            <p class="bar"><a href={entryPage(entry)}>tables, figures, 3D</a> <a href={`archives/${encodeURIComponent(entry.name)}.legopt-archive`} download>archive</a> <a href={`archives/${encodeURIComponent(entry.name)}.judged.json`} download>judgement</a></p>
            <table class="lines"><tbody>{facts.filter(([, value]) => value).map(([name, value]) => <tr key={name}><th scope="row">{name}</th><td>{value}</td></tr>)}</tbody></table>
          </section>);
      })}
    </>
  );
}

function boardOf(site: Site, state: State): number | null {
  const b = Number(state.b);
  return Number.isInteger(b) && b >= 0 && b < site.boards.length ? b : null;
}

export function SiteView({ page }: { page: Page }) {
  const state = useAddress(), site = page.site!, b = boardOf(site, state), v = state.v ?? 'tiers';
  const i = Number(state.p), one = state.p !== undefined && b !== null && i >= 0 && i < site.boards[b].problems.length;
  const tab = (key: string, label: string) => <a href={href({ v: key === 'tiers' ? undefined : key }, {})} aria-current={v === key ? 'page' : undefined}>{label}</a>;
  return (
    <>
      <header><h1>{page.title} <span class="setting">edition {site.edition}</span></h1>
        <nav aria-label="Views">{tab('tiers', 'Leaderboards')}{tab('archives', `Archives (${site.entries.length})`)}<a href="viewer.html">Open a file</a>
          {v === 'problems' && b !== null && <label>Problems of <select value={b} onChange={(x) => go({ b: x.currentTarget.value, p: undefined })}>
            {site.boards.map((board, k) => board.rows.length > 0 && <option key={k} value={k}>{site.tiers[board.tier].title}: {boardTitle(board)}</option>)}</select></label>}</nav></header>
      <main><ErrorNote view={location.hash}>
        {v === 'tiers' && <Tiers site={site} />}
        {v === 'archives' && <EntriesView site={site} />}
        {v === 'problems' && b !== null && (one ? <ProblemView site={site} b={b} i={i} /> : <ProblemsView site={site} b={b} />)}
      </ErrorNote></main>
      <footer>{page.notes.length > 0 && <ul class="notes">{page.notes.map((note) => <li key={note}>{note}</li>)}</ul>}<p>Judged and written by legopt {page.legopt.version}, build {page.legopt.build_id}.</p></footer>
    </>
  );
}
