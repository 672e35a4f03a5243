// Reads a results database by SQLite, compiled for browsers (sql.js).
import initSqlJs, { type Database } from 'sql.js/dist/sql-wasm-inline.js';
import pageJobs from '../../db/queries/page_jobs.sql';
import type { OpenedExperiment, OpenedFile } from './opened';

let open: Database | null = null;  // the last one, whose solutions are read when they are shown

const SCHEMA = 17, MOST_BYTES = 1_000_000_000;

type Value = number | string | Uint8Array | null;
type RowOf = Record<string, Value>;

function query(db: Database, sql: string, given: Record<string, number> = {}): RowOf[] {
  const statement = db.prepare(sql, given), rows: RowOf[] = [];
  while (statement.step()) rows.push(statement.getAsObject() as RowOf);
  statement.free();
  return rows;
}

function float64s(blob: Uint8Array): number[] {
  const view = new DataView(blob.buffer, blob.byteOffset, blob.byteLength);
  return Array.from({ length: blob.byteLength / 8 }, (_, i) => view.getFloat64(8 * i, true));
}

const COLUMNS = ['job', 'problem', 'repetition', 'state', 'status', 'literal', 'strict', 'solid', 'physical', 'cost', 'wall_us', 'cpu_us', 'iterations', 'restarts', 'term_evaluations', 'failed_waypoint', 'detail'];
const ORDER = { task: ['posture', 'motion', 'continuous', 'balanced', 'timed'], initialization: ['good', 'in_collision'] };

function experimentOf(db: Database, row: RowOf): OpenedExperiment {
  const id = row.experiment_id as number;
  const methods = query(db, 'SELECT method_id, name, hash, options_json, multi_starts, sample_size, incremental, collision FROM methods JOIN '
    + '(SELECT method_id, min(cell_id) AS first FROM cells WHERE experiment_id = :id GROUP BY method_id) USING (method_id) ORDER BY first', { ':id': id });
  const columns = query(db, 'SELECT DISTINCT task, initialization FROM cells WHERE experiment_id = :id', { ':id': id }) as { task: string; initialization: string }[];
  const place = (c: { task: string; initialization: string }) => 2 * ORDER.task.indexOf(c.task) + ORDER.initialization.indexOf(c.initialization);
  columns.sort((a, b) => place(a) - place(b));
  const jobs = query(db, pageJobs.replace(/^.*-- if :.*$/m, ''), { ':experiment_id': id });
  const lists = Object.fromEntries(COLUMNS.map((key) => [key, jobs.map((job) => job[key])])) as OpenedExperiment['jobs'];
  lists.method = jobs.map((job) => methods.findIndex((m) => m.method_id === job.method));
  lists.column = jobs.map((job) => columns.findIndex((c) => c.task === job.task && c.initialization === job.initialization));
  const builds = query(db, 'SELECT DISTINCT build_id FROM result_workers JOIN workers USING (worker_id) WHERE experiment_id = :id AND build_id IS NOT NULL', { ':id': id });
  return {
    id, name: row.name as string, dataset: { name: row.dataset as string, hash: row.hash as string }, rule: row.rule as string, seed: row.seed as number, repetitions: row.repetitions as number,
    build_ids: builds.map((build) => build.build_id).join(' '),
    methods: methods.map((m) => ({ name: m.name as string, hash: m.hash as string, multi_starts: m.multi_starts as number, sample_size: m.sample_size as number, incremental: m.incremental === 1, collision: m.collision as string, options: JSON.parse(m.options_json as string) })),
    columns, jobs: lists,
    solution: (job) => query(db, 'SELECT x FROM waypoints WHERE job_id = :job ORDER BY waypoint', { ':job': job }).map(({ x }) => float64s(x as Uint8Array)),
  };
}

export async function readDatabase(bytes: Uint8Array): Promise<OpenedFile> {
  if (bytes.length > MOST_BYTES) throw new Error(`it has ${(bytes.length / 1e9).toFixed(1)} GB; a browser reads 1 GB. 'legopt serve --db FILE' shows it`);
  const { Database } = await initSqlJs();
  open?.close();
  open = new Database(bytes);
  const db = open, [{ user_version: schema }] = query(db, 'PRAGMA user_version');
  if (schema !== SCHEMA) throw new Error(`it is no results database of schema ${SCHEMA} (it has ${schema}). 'legopt report --db FILE' reads other schemas`);
  const rows = query(db, 'SELECT experiment_id, e.name, d.name AS dataset, d.hash, rule, seed, repetitions FROM experiments AS e JOIN datasets AS d USING (dataset_id) ORDER BY experiment_id DESC');
  if (rows.length === 0) throw new Error('it has no experiment');
  return { kind: 'database', facts: [['experiments', rows.map((row) => `${row.experiment_id} ${row.name}`).join(', ')]], experiments: rows.map((row) => experimentOf(db, row)) };
}
