// Reads an archive (docs/reference/archives.md). Only its hash and form are checked: nothing is judged here.
import { blake2b } from '@noble/hashes/blake2.js';
import { bytesToHex } from '@noble/hashes/utils.js';
import { decompress } from 'fzstd';
import type { OpenedExperiment, OpenedFile, OpenedMethod } from './opened';

const FORMAT = 1, NEWLINE = 10, HASH_BYTES = 32, MOST_BYTES = 512 * 2 ** 20, MOST_TEXT_BYTES = 2 ** 31;

/** The size that a zstd frame states; null: none (RFC 8878, 3.1.1.1). */
function unpackedSize(frame: Uint8Array): number | null {
  const view = new DataView(frame.buffer, frame.byteOffset, frame.byteLength);
  if (frame.length < 14 || view.getUint32(0, true) !== 0xfd2fb528) return null;
  const flags = view.getUint8(4), single = (flags & 0x20) !== 0, at = 5 + (single ? 0 : 1) + [0, 1, 2, 4][flags & 3];
  switch (flags >> 6) {
    case 0: return single ? view.getUint8(at) : null;
    case 1: return view.getUint16(at, true) + 256;
    case 2: return view.getUint32(at, true);
    default: return Number(view.getBigUint64(at, true));
  }
}

interface Header {
  about: { title: string; authors: string[]; paper: string; licence: string; code: string; notes: string };
  experiment: string; dataset: string; dataset_hash: string; seed: number; repetitions: number; rule: string;
  tasks: { task: string; problems: number[] }[]; initializations: string[];
  methods: { name: string; hash: string; options: string; multi_starts: number; sample_size: number }[];
  builds: { id: string; text: string; processor: string }[];
}
interface Result {
  method: number; build: number; task: string; initialization: string; problem: number; repetition: number; status: string;
  cpu_us: number; evaluations: number; iterations: number; restarts: number; cost?: number; x: (number | null)[][];
  literal?: string; strict?: string; solid?: string; physical?: string;
}

function methodOf({ name, hash, options, multi_starts, sample_size }: Header['methods'][number]): OpenedMethod {
  const all = JSON.parse(options) as { incremental?: boolean; options?: { collision?: string } };
  return { name, hash, multi_starts, sample_size, incremental: all.incremental ?? false, collision: all.options?.collision ?? 'solid', options: all };
}

/** The lines of a text. */
function* linesOf(bytes: Uint8Array): Generator<string> {
  const decoder = new TextDecoder();
  for (let from = 0; from < bytes.length;) {
    const end = bytes.indexOf(NEWLINE, from), to = end < 0 ? bytes.length : end;
    if (to > from) yield decoder.decode(bytes.subarray(from, to));
    from = to + 1;
  }
}

interface Place { method: number; task: string; initialization: string; problem: number; repetition: number }

/** All jobs of the experiment, numbered as on the archive's page; null: no result. */
function jobsOf(header: Header, results: Result[]): { result: Result | null; place: Place }[] {
  const key = (method: number, task: string, initialization: string, problem: number, repetition: number) => [method, task, initialization, problem, repetition].join(' ');
  const found = new Map(results.map((r) => [key(r.method, r.task, r.initialization, r.problem, r.repetition), r]));
  const jobs = [];
  for (let method = 0; method < header.methods.length; ++method) {
    for (const { task, problems } of header.tasks) for (const initialization of header.initializations) for (const problem of problems) {
      for (let repetition = 0; repetition < header.repetitions; ++repetition) {
        jobs.push({ place: { method, task, initialization, problem, repetition }, result: found.get(key(method, task, initialization, problem, repetition)) ?? null });
      }
    }
  }
  return jobs;
}

function experimentOf(header: Header, results: Result[]): OpenedExperiment {
  const columns = header.tasks.flatMap(({ task }) => header.initializations.map((initialization) => ({ task, initialization })));
  const jobs = jobsOf(header, results), list = <T>(value: (r: Result) => T) => jobs.map(({ result }) => (result ? value(result) : null));
  const text = (key: 'literal' | 'strict' | 'solid' | 'physical') => list((r) => r[key] ?? null);
  return {
    id: 1, name: header.experiment, dataset: { name: header.dataset, hash: header.dataset_hash }, rule: header.rule, seed: header.seed, repetitions: header.repetitions,
    build_ids: [...new Set(header.builds.map((build) => build.id))].join(' '), methods: header.methods.map(methodOf), columns,
    jobs: {
      job: jobs.map((_, i) => i + 1), method: jobs.map(({ place }) => place.method), column: jobs.map(({ place }) => columns.findIndex((c) => c.task === place.task && c.initialization === place.initialization)),
      problem: jobs.map(({ place }) => place.problem), repetition: jobs.map(({ place }) => place.repetition),
      state: jobs.map(({ result }) => (result ? 'done' : 'failed')), status: list((r) => r.status), literal: text('literal'), strict: text('strict'), solid: text('solid'), physical: text('physical'),
      cost: list((r) => r.cost ?? null), wall_us: list((r) => r.cpu_us), cpu_us: list((r) => r.cpu_us), iterations: list((r) => r.iterations), restarts: list((r) => r.restarts),
      term_evaluations: list((r) => r.evaluations),
    },
    solution: (job) => (jobs[job - 1]?.result?.x ?? []).map((x) => x.map((value) => value ?? NaN)),
  };
}

export function readArchive(bytes: Uint8Array): OpenedFile {
  const first = bytes.indexOf(NEWLINE), second = bytes.indexOf(NEWLINE, first + 1);
  const [, format, hash] = new TextDecoder().decode(bytes.subarray(0, first)).split(' ');
  if (first < 0 || second < 0) throw new Error('it is cut off');
  if (Number(format) > FORMAT) throw new Error(`it has format ${format}; this page reads ${FORMAT}`);
  if (bytesToHex(blake2b(bytes.subarray(first + 1), { dkLen: HASH_BYTES })) !== hash) throw new Error('its content has another hash than its first line says: it is damaged or was changed');
  const packed = bytes.subarray(second + 1), size = unpackedSize(packed);
  if (bytes.length > MOST_BYTES || size === null || size > MOST_TEXT_BYTES) throw new Error('it is larger than an archive may be');
  const header = JSON.parse(new TextDecoder().decode(bytes.subarray(first + 1, second))) as Header;
  const results = [...linesOf(decompress(packed))].map((line) => JSON.parse(line) as Result);
  const { title, authors, paper, licence, code, notes } = header.about;
  const facts: [string, string][] = [['title', title], ['authors', authors.join(', ')], ['paper', paper], ['licence', licence], ['code', code], ['notes', notes],
    ['made by', header.builds.map((build) => `build ${build.id} (${build.text}) on ${build.processor}`).join('; ')], ['hash', hash]];
  return { kind: 'archive', facts: facts.filter(([, value]) => value), experiments: [experimentOf(header, results)] };
}
