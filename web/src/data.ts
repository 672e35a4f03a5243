// The data contract, docs/reference/page-data.md: the content that C++ wrote into this file, or sends, and the decoding
// of its blocks.

import { ask, pause } from './background';
import { JobTable, type Rule } from './job_table';
import type { Site } from './site';
import { unpacked, type SentPage, type WholePage } from './store';

export interface Curve { x: ArrayLike<number>; y: ArrayLike<number> }
export interface Profile { curves: (Curve | null)[]; problems: number; unsolved: number }
export interface MethodValues {
  effort_ms: (number | null)[]; cost: (number | null)[]; effort_ratio: (number | null)[]; cost_ratio: (number | null)[];
  share: (number | null)[]; job: (number | null)[];
}
export type Effort = 'work' | 'time';
export interface ColumnFigures {
  limit_ms: number; problems: number[]; complete?: number;
  methods: MethodValues[]; methods_effort: Effort;  // measure of effort_ms and effort_ratio
  effort: Effort;  // measure of the curves
  profiles: { effort: Profile | null; cost: Profile | null };
  efforts: (Curve | null)[]; costs: (Curve | null)[];
}
export interface Column {
  task: string; initialization: string; title: string; causes: (Record<string, number> | null)[];
}
export interface Method {
  id: number; name: string; title: string; choice: string; multi_starts: number; sample_size: number;
  incremental: boolean; collision: string; hash: string; options: unknown;
}
export interface Statistics {
  method_id: number; task: string; initialization: string; n: number; missing: number; runs: number; solved: number;
  share_lower: number | null; share_upper: number | null; time_median_ms: number | null; time_q95_ms: number | null;
  par10_ms: number | null; ert_ms: number | null; mean_rank: number | null; cost_median: number | null;
  cost_q95: number | null; common: number; common_time_ms: number | null; common_cost: number | null; paired?: number; time_ratio?: number | null; cost_ratio?: number | null;
  reported: number; contended: number; stopped: number;
}
export interface TableCell {
  n: number; finished: number; solved: number; dead: number; failed: number; cancelled: number;
  clock_stopped: number; cost: number | null; time_s: number | null;
  by_feasibility?: Record<'certified' | 'infeasible' | 'open', { n: number; solved: number }>;
}
/** Successes by another rule than the table's: for each of its rows, by column name. */
export interface OtherRule { rule: string; solved: Record<string, number>[] }
export interface TableRow { method: string; [task: string]: unknown }
export interface Ratio { n: number; ratio: number | null; interval: (number | null)[]; wilcoxon_p: number; adjusted_p: number; lower: number; change: string }
export interface CellComparison {
  task: string; initialization: string; change: string; pairs: number; both: number; only_a: number; only_b: number;
  neither: number; missing: number; limit_ms: number; contended_share: number;
  method_a: { name: string }; method_b: { name: string };
  success: { share_a: number; share_b: number; difference: number; interval: (number | null)[]; mcnemar_mid_p: number; permutation_p: number | null; adjusted_p: number; change: string };
  work: Ratio; time: Ratio; cost: Ratio; par10_a_ms: number; par10_b_ms: number; par10_ratio_interval: (number | null)[];
  runtimes: string; crossing_ms: number | null;
  fastest: { problem: number; job_a: number; job_b: number; time_ratio: number }[];
  slowest: { problem: number; job_a: number; job_b: number; time_ratio: number }[];
}
export interface Pair { a: number; b: number; refused?: string }
export interface PairFigures {
  report: { a: { title: string }; b: { title: string }; dataset: string; change: string; notes: string[]; least_discordant: number; comparisons: CellComparison[] };
  cells: ColumnFigures[];
}
/** CPU time of a solve in us; wall time of results without it. */
export const solveTime = (cpu_us: number | null, wall_us: number | null) => cpu_us || wall_us;
export interface Experiment {
  place: string; newest_result_utc?: string | null; id: number; name: string; state: string; unfinished: number;
  dataset: { name: string; hash: string; split: string }; rule: Rule; seed: number; repetitions: number;
  submitted_utc: string; origin: string; build_ids: string;
  table: { rows: TableRow[]; jobs: number; finished: number; origins: Record<string, unknown>[]; other_rule?: OtherRule };
  statistics: { columns: { task: string; initialization: string; common: number; complete: number; left_out?: string[]; reference?: string | null; informative?: number | null; cochran_q: number | null; cochran_p: number | null }[]; rows: Statistics[] };
  methods: Method[]; columns: Column[]; pairs: Pair[]; jobs: JobTable; outcomes: string[]; dataset_index: number | null;
}
export type Pose = [number, number, number, number, number, number, number];
export interface Joint {
  name: string; type: string; parent: number; child: number; origin: Pose; axis: [number, number, number]; dof: number;
  multiplier: number; offset: number;
  lower: number | null; upper: number | null;
}
export interface Dataset {
  name: string; hash: string;
  robot: {
    name: string; dofs: string[];
    weight_N?: number; efforts?: (number | null)[];  // per degree of freedom, N m or N; absent in older files
    velocities?: (number | null)[];  // limits likewise, rad/s or m/s
    links: { name: string; mass_kg: number; com: [number, number, number]; meshes: number[]; convex: number | null }[];
    joints: Joint[]; feet: { link: number; name: string; kind: string; lower: number[]; upper: number[]; outline: number[][] }[];
  };
  scene: { objects: { name: string; mesh: number }[]; convex: number | null; lower: number[]; upper: number[] };
  problems: Record<string, Record<string, { feet: { link: number; contact: string; target: Pose }[]; polygon: [number, number][] }[]>>;
  check: { x: number[]; poses: Pose[] };
  geometry: { block: string; meshes: [number, number, number, number][] };
}
export interface Overlap {
  link: number; other?: number; object?: number; names: [string, string]; depth_m: number | null;
  literal_m: number | null; inside_m: number; fails: string | null; points?: [number[], number[]];
}
/** A contact that carries. `forces`: on the robot, in the world; `collapse`: how it moves if nothing holds the robot. */
export interface ContactHolding {
  contact: string; normal: number[]; friction: number | null; forces: { at: number[]; force_N: number[] }[];
  collapse?: { movement: 'rests' | 'slips' | 'yields' | 'lifts'; at: number[]; direction?: number[]; speed?: number };
}
export interface Holding {
  balanced: boolean; contacts: ContactHolding[]; polygon?: [number, number][];
  torque_ratio?: number | null; torques?: (number | null)[]; overloaded?: number[]; com_direction?: number[];
}
export interface Findings {
  feet: { link: string; error: number; component: string; violated: boolean }[];
  com: number[]; polygon: [number, number][]; com_m: number | null; com_violated: boolean;
  limits: { joint: string; unit: string; link: number; value: number; limit: number; excess: number; violated: boolean }[];
  overlaps: Overlap[]; values: { check: string; subject: string; value: number | null; unit: string; tolerance: string; violated: boolean }[];
  holding?: Holding;  // absent in older files
}
export interface Trace {
  of: number; window: number[]; restart: number[]; accepted: number[]; evaluations: number[]; elapsed_us: number[];
  cost: (number | null)[]; violation: (number | null)[];
}
export interface Solution {
  experiment: number; job: number; waypoints: number; encoding: 'd32' | 'f64'; offset: number; bytes: number;
  malformed?: boolean; unsolved?: { from: number; waypoints_per_stance: number }; failed_waypoint?: number; findings?: Findings[];
  between?: [number, number, Overlap[]][]; trace: Trace | null;
  times?: number[];  // paths: time of each configuration, in steps from waypoint to waypoint
  x: Float64Array[];
}
/** A motion in time, or the reason why it cannot be executed. Lists have one entry per sample. */
export interface Playback {
  duration_s: number | null; reason?: string; blocked_at?: number; blocked_by?: string;
  nearest?: Record<string, number>;  // shares of the duration by the nearest limit
  times_s: number[]; waypoints: number[]; x: number[][]; velocities: number[][]; torques: number[][];
  points: { contact: string; at: number[]; normal: number[]; friction: number | null }[];
  forces: number[][][];  // per force: index of its point, then x, y, z in N
}
export interface Page {
  format: number; kind: 'report' | 'view' | 'site' | 'viewer'; title: string; written_utc?: string;
  home?: string;  // address of the site that the page belongs to
  legopt: { version: string; build_id: string }; rule: string; notes: string[];
  version: number;  // number of this page in the background
  experiments?: Experiment[]; across?: Pair[]; datasets: Dataset[]; chunks: [number, number][][];
  jobs?: Record<string, unknown>[]; problem?: { task: string; id: number }; site?: Site;
}

/** Whether a server sends the blocks, instead of this file holding them (legopt serve). */
export const isLive = document.documentElement.dataset.live !== undefined;

class ServerError extends Error {
  constructor(readonly status: number, text: string) { super(`the server answered ${status}: ${text}`); }
}

const BUSY = 503, RETRY_MS = 1000;

async function sentBlock(name: string): Promise<ArrayBuffer> {
  const answer = await fetch(`blocks/${name}${location.search}`);
  if (answer.status === 404) throw new Error(await answer.text());  // names the missing block and the reason
  if (!answer.ok || !answer.body) throw new ServerError(answer.status, await answer.text());
  return answer.arrayBuffer();
}

async function blockOf(name: string): Promise<ArrayBuffer | string> {
  if (isLive) return sentBlock(name);
  const block = document.getElementById(name);
  if (!block) throw new Error(`this file has no block '${name}': it was cut off; write it again`);
  return block.textContent ?? '';
}

const bytesOf = async (name: string): Promise<ArrayBuffer> => unpacked(await blockOf(name));

async function readJson<T>(name: string): Promise<T> {
  return JSON.parse(new TextDecoder().decode(await bytesOf(name))) as T;
}

const withTables = (page: SentPage): Page => ({ ...page, experiments: page.experiments?.map((e) => ({ ...e, jobs: new JobTable(e.jobs) })) });

export async function readPage(): Promise<Page> {
  const page = await ask('page', await blockOf('page'));
  await pause();
  return withTables(page);
}

/** Solutions of a file that the user opened, by experiment and job. */
let opened: ((experiment: number, job: number) => Solution | null) | null = null;

/** Makes a page of other data than this file's, with its own solutions. */
export async function openPage(page: WholePage, solution: (experiment: number, job: number) => Solution | null): Promise<Page> {
  const sent = await ask('open', page);
  opened = solution;
  return withTables(sent);
}

/** Inverse of PackWaypoints and PackExactly (client/page/page_file.h). */
export function unpack(bytes: DataView, encoding: 'd32' | 'f64'): Float64Array[] {
  const count = bytes.getUint32(0, true), size = bytes.getUint32(4, true), values = count * size, head = 8;
  const rows = Array.from({ length: count }, () => new Float64Array(size));
  for (let column = 0; column < size; ++column) {
    let sum = 0;
    for (let w = 0; w < count; ++w) {
      if (encoding === 'f64') {
        rows[w][column] = bytes.getFloat64(head + 8 * (w * size + column), true);
        continue;
      }
      const at = head + column * count + w;
      sum += bytes.getUint8(at) | (bytes.getUint8(at + values) << 8) | (bytes.getUint8(at + 2 * values) << 16) |
        (bytes.getUint8(at + 3 * values) << 24);
      rows[w][column] = sum * 1e-7;
    }
  }
  return rows;
}

const chunks = new Map<number, Promise<Solution[]>>();  // key: index, or job with a server

function readChunk(index: number): Promise<Solution[]> {
  let chunk = chunks.get(index);
  if (!chunk) {
    chunk = Promise.all([readJson<Solution[]>(`solutions-${index}`), bytesOf(`motion-${index}`)]).then(([list, bytes]) => {
      for (const solution of list) {
        solution.x = unpack(new DataView(bytes, solution.offset, solution.bytes), solution.encoding);
      }
      return list;
    });
    chunks.set(index, chunk);
  }
  return chunk;
}

/** An error's message for the user. */
export const reasonOf = (error: unknown): string => (error instanceof Error ? error.message : String(error)).trim();

/** The solution of a job, or null if this file does not contain it. Throws, with the reason, if it cannot be loaded. */
export async function readSolution(page: Page, experiment: number, job: number): Promise<Solution | null> {
  if (isLive) {
    const sent = await readChunk(job).catch((error) => { chunks.delete(job); throw error; });
    if (sent.length === 0) throw new Error(`the server sent no solution of job ${job}`);
    return { ...sent[0], experiment };
  }
  if (opened) return opened(experiment, job);
  const index = page.chunks.findIndex((chunk) => chunk.some(([e, j]) => e === experiment && j === job));
  if (index < 0) return null;
  return (await readChunk(index)).find((s) => s.experiment === experiment && s.job === job) ?? null;
}

/** Asks until the server, which computes one motion at a time, has computed this one. */
async function sentPlayback(name: string): Promise<Playback> {
  for (;;) {
    try {
      return await readJson<Playback>(name);
    } catch (error) {
      if (!(error instanceof ServerError) || error.status !== BUSY) throw error;
    }
    await new Promise((resolve) => { setTimeout(resolve, RETRY_MS); });
  }
}

const playbacks = new Map<number, Promise<Playback>>();

/** The motion of a job in time; null if this file does not contain it. Throws, with the reason, if it cannot be loaded. */
export async function readPlayback(job: number): Promise<Playback | null> {
  const name = `playback-${job}`;
  if (!isLive && !document.getElementById(name)) return null;
  if (!playbacks.has(job)) playbacks.set(job, isLive ? sentPlayback(name) : readJson<Playback>(name));
  return playbacks.get(job)!.catch((error) => { playbacks.delete(job); throw error; });
}

export function holdsSolution(page: Page, experiment: number, job: number): boolean {
  if (isLive || opened) return true;  // any job that has one
  return page.chunks.some((chunk) => chunk.some(([e, j]) => e === experiment && j === job));
}

export interface Mesh { positions: Float32Array; indices: Uint32Array }

export async function readGeometry(dataset: Dataset): Promise<Mesh[]> {
  const bytes = await bytesOf(dataset.geometry.block);
  return dataset.geometry.meshes.map(([vertexOffset, vertices, indexOffset, triangles]) => ({
    positions: new Float32Array(bytes, vertexOffset, 3 * vertices),
    indices: new Uint32Array(bytes, indexOffset, 3 * triangles),
  }));
}
