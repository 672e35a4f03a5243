// The benchmark table, shown when the page opens.
import type { Experiment, OtherRule, Statistics, TableCell } from './data';
import { go, href, type State } from './state';
import { DASH, INFINITY, MISSING, csv, number, save, time, words } from './text';
import { SIGNS, colour } from './marks';

interface Charge {
  key: string; label: string; says: string;
  time: (s: Statistics, c: TableCell) => string; cost: (s: Statistics, c: TableCell) => string;
}
/** A quantile over all problems: infinite if too few were solved. */
const quantile = (value: number | null, s: Statistics, show: (v: number) => string) =>
  value === null ? (s.n > 0 ? INFINITY : DASH) : show(value);

export const CHARGES: Charge[] = [
  { key: 'solved', label: 'solved only', says: 'Means over what each method solved, per waypoint: such means reward failing.',
    time: (_, c) => time(c.time_s === null ? null : 1e3 * c.time_s), cost: (_, c) => number(c.cost) },
  { key: 'common', label: 'solved by all', says: 'Geometric means over the problems that all methods solved (times of whole solves, shifted by 1 ms).',
    time: (s) => time(s.common_time_ms), cost: (s) => number(s.common_cost) },
  { key: 'ratio', label: 'ratio to the reference', says: 'Geometric means of ratios to the row that solved the most, over the problems that both solved.',
    time: (s) => number(s.time_ratio), cost: (s) => number(s.cost_ratio) },
  { key: 'median', label: 'median', says: 'Medians over all problems, an unsolved one infinite; times of whole solves.',
    time: (s) => quantile(s.time_median_ms, s, time), cost: (s) => quantile(s.cost_median, s, number) },
  { key: 'q95', label: '95 % quantile', says: '95 % quantiles over all problems, an unsolved one infinite; times of whole solves.',
    time: (s) => quantile(s.time_q95_ms, s, time), cost: (s) => quantile(s.cost_q95, s, number) },
  { key: 'par10', label: 'PAR10', says: 'Mean time of a whole solve, a failed run at its charge (docs/explanation/statistics.md); a cost cannot be charged.',
    time: (s) => time(s.par10_ms), cost: () => DASH },
  { key: 'ert', label: 'ERT', says: 'Time of all runs over the number of successes; a cost cannot be charged.',
    time: (s) => quantile(s.ert_ms, s, time), cost: () => DASH },
];

export function cellOf(experiment: Experiment, method: number, column: number): TableCell | undefined {
  const { task, initialization } = experiment.columns[column];
  return (experiment.table.rows[method]?.[task] as Record<string, TableCell> | undefined)?.[initialization];
}

export function statisticsOf(experiment: Experiment, method: number, column: number): Statistics | undefined {
  const { task, initialization } = experiment.columns[column];
  const id = experiment.methods[method].id;
  return experiment.statistics.rows.find((s) => s.method_id === id && s.task === task && s.initialization === initialization);
}

function Interval({ s, i }: { s: Statistics; i: number }) {
  if (s.n === 0 || s.share_lower === null || s.share_upper === null) return <span class="interval">{DASH}</span>;
  const percent = (v: number) => (100 * v).toFixed(v === 1 || v === 0 ? 0 : 1);
  return (
    <span class="interval" title={`95 % interval (Wilson) over ${s.n} problems: ${percent(s.share_lower)} to ${percent(s.share_upper)} %`}>
      <svg width="56" height="9" aria-hidden="true">
        <line x1="1" x2="55" y1="4.5" y2="4.5" class="track" />
        <line x1={1 + 54 * s.share_lower} x2={1 + 54 * s.share_upper} y1="4.5" y2="4.5" stroke={colour(i)} stroke-width="3" />
      </svg>
      {percent(s.share_lower)}{DASH}{percent(s.share_upper)}
    </span>
  );
}

function Causes({ causes }: { causes: Record<string, number> | null }) {
  const entries = Object.entries(causes ?? {}).filter(([cause]) => !MISSING.includes(cause));
  if (entries.length === 0) return <span class="none">{DASH}</span>;
  return <>{entries.map(([cause, n]) => <span class="cause" key={cause}>{n} {words(cause)}</span>)}</>;
}

/** The success among the certified problems, unless all problems are certified. */
function Certified({ cell }: { cell: TableCell }) {
  const known = cell.by_feasibility;
  if (!known || known.certified.n === cell.n) return null;
  const rest = `${known.open.solved} of ${known.open.n} open, ${known.infeasible.solved} of ${known.infeasible.n} infeasible`;
  return <span class="interval" title={`certified: a posture is known for every stance (legopt certify); ${rest}`}>{known.certified.solved}/{known.certified.n} certified</span>;
}

function Group({ experiment, index, column, charge }: { experiment: Experiment; index: number; column: number; charge: Charge }) {
  const { title, causes } = experiment.columns[column];
  const common = experiment.statistics.columns[column];
  const jobs = (m: number, only: string) => href({ v: 'jobs', e: index || undefined, m, c: column, o: only, q: undefined });
  return (
    <section class="group">
      <h3>{title}</h3>
      <table class="scores" data-column={column}>
        <thead><tr><th scope="col">Method</th><th scope="col" title="solved of all jobs; higher is better">Solved {'\u2191'}</th>
          <th scope="col" class="wide" title="of the share of problems">95 % interval</th><th scope="col">Not solved</th>
          <th scope="col" title="lower is better">Cost {'\u2193'}</th><th scope="col" title="lower is better">Time {'\u2193'}</th></tr></thead>
        <tbody>{experiment.methods.map((method, m) => {
          const cell = cellOf(experiment, m, column), s = statisticsOf(experiment, m, column);
          if (!cell || !s) {
            return <tr key={m}><th scope="row">{method.title}</th><td colSpan={5}>{DASH}</td></tr>;
          }
          const disturbed = s.reported > 0 && s.contended > 0.2 * s.reported;
          return (
            <tr key={m} data-method={m}>
              <th scope="row"><span class="sign" style={{ color: colour(m) }} aria-hidden="true">{SIGNS[m % SIGNS.length]}</span>
                <span title={method.choice}>{method.title}</span>
                <span class="setting">{method.multi_starts > 0 ? ` ${method.multi_starts}\u00d7` : ''}{method.sample_size < 100 ? ` ${method.sample_size} %` : ''}{method.collision === 'solid' ? '' : ` ${words(method.collision)}`}</span></th>
              <td class="count"><a href={jobs(m, 'all')}>{cell.solved}/{cell.n}</a>
                <Certified cell={cell} />
                <span class="narrow"><Interval s={s} i={m} /></span>
                {cell.finished < cell.n && <span class="flag soft" title="jobs that have not ended">{cell.n - cell.finished} left</span>}
                {cell.cancelled > 0 && <span class="flag soft">{cell.cancelled} cancelled</span>}</td>
              <td class="wide"><Interval s={s} i={m} /></td>
              <td class="failures">{cell.solved < cell.finished - cell.cancelled
                ? <a class="failed" href={jobs(m, 'unsolved')}><Causes causes={causes[m]} /></a> : <Causes causes={null} />}</td>
              <td class="figure-cell">{charge.cost(s, cell)}</td>
              <td class="figure-cell">{charge.time(s, cell)}{disturbed && charge.key === 'solved' &&
                <span class="flag soft" title={`${s.contended} of ${s.reported} runs were disturbed by others`}>contended</span>}</td>
            </tr>
          );
        })}</tbody>
      </table>
      <p class="below">{belowText(common)}</p>
    </section>
  );
}

/** The notes below a task and initial guess. */
function belowText(column: Experiment['statistics']['columns'][number]): string {
  const parts = [`intervals, medians, means and tests: ${column.complete} problem${column.complete === 1 ? '' : 's'} that all rows have completed`];
  if (column.left_out && column.left_out.length > 0) parts.push(`left out, without one: ${column.left_out.join(', ')}`);
  if (column.complete === 0) return parts.join(' \u00b7 ');
  parts.push(`${column.common} solved by all`);
  if (column.reference) parts.push(`reference: ${column.reference}`);
  if (column.informative === 0) parts.push('all methods solved the same ones');
  else if (column.cochran_p !== null) parts.push(`Cochran's Q ${number(column.cochran_q)}, p ${column.cochran_p < 0.001 ? '< 0.001' : '= ' + column.cochran_p.toFixed(3)}`);
  return parts.join(' \u00b7 ');
}

function tableCsv(experiment: Experiment, charge: Charge): string {
  const rows: (string | number | null)[][] = [['method', 'task', 'initialization', 'n', 'solved', 'share_lower', 'share_upper', 'causes', 'charge', 'cost', 'time']];
  experiment.columns.forEach((column, c) => experiment.methods.forEach((method, m) => {
    const cell = cellOf(experiment, m, c), s = statisticsOf(experiment, m, c);
    if (!cell || !s) return;
    rows.push([method.title, column.task, column.initialization, cell.n, cell.solved, s.share_lower, s.share_upper,
      Object.entries(column.causes[m] ?? {}).map(([k, n]) => `${n} ${k}`).join('; '), charge.key, charge.cost(s, cell), charge.time(s, cell)]);
  }));
  return csv(rows);
}

export function TableView({ experiments, state }: { experiments: Experiment[]; state: State }) {
  const charge = CHARGES.find((c) => c.key === state.charge) ?? CHARGES[0];
  return (
    <>
      <div class="bar">
        <label>Costs and times: <select value={charge.key} onChange={(e) => go({ charge: e.currentTarget.value })}>
          {CHARGES.map((c) => <option value={c.key} key={c.key}>{c.label}</option>)}</select></label>
        <span class="says">{charge.says}</span>
      </div>
      {experiments.map((experiment, e) => (
        <section key={e}>
          {experiments.length > 1 && <h2>{experiment.id} {experiment.name} <span class="setting">{experiment.place}</span></h2>}
          <div class="groups">{experiment.columns.map((_, c) => <Group key={c} experiment={experiment} index={e} column={c} charge={charge} />)}</div>
          {experiment.table.other_rule && <p class="below" data-other-rule>{otherRuleText(experiment, experiment.table.other_rule)}</p>}
          <p class="caption">{captionOf(experiment)} <button onClick={() => save('table.csv', tableCsv(experiment, charge), 'text/csv')}>CSV</button></p>
        </section>
      ))}
    </>
  );
}

/** Counts by another rule than the table's, in the order of its rows and columns. */
function otherRuleText(e: Experiment, other: OtherRule): string {
  const rows = e.methods.map((method, m) => {
    const counts = e.columns.map((column, c) => `${other.solved[m]?.[`${column.task}_${column.initialization}`] ?? DASH}/${cellOf(e, m, c)?.n ?? DASH}`);
    return `${method.title}${method.multi_starts > 0 ? ` ${method.multi_starts}\u00d7` : ''} ${counts.join(', ')}`;
  });
  return `Solved by the ${other.rule} rule: ${rows.join('; ')}.`;
}

export function captionOf(e: Experiment): string {
  return `Experiment ${e.id} '${e.name}', ${e.rule} rule, dataset ${e.dataset.name} (${e.dataset.hash.slice(0, 12)}), seed ${e.seed}, ` +
    `${e.table.jobs} jobs${e.unfinished > 0 ? `, ${e.unfinished} UNFINISHED` : ''}, build ${e.build_ids || 'unknown'}.`;
}
