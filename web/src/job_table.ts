// The jobs of an experiment as typed columns, which another thread can send without delay.

const NUMBERS = ['job', 'method', 'column', 'problem', 'repetition', 'cost', 'wall_us', 'cpu_us', 'iterations', 'restarts', 'term_evaluations', 'failed_waypoint'] as const;
const TEXTS = ['state', 'status', 'literal', 'strict', 'solid', 'physical', 'detail'] as const;
type NumberKey = (typeof NUMBERS)[number];
type TextKey = (typeof TEXTS)[number];

/** Texts as indices into the distinct ones. */
interface TextColumn { codes: Uint32Array; distinct: (string | null)[] }
export interface JobColumns {
  numbers: Record<NumberKey, Float64Array>;  // NaN: null
  texts: Record<TextKey, TextColumn>;
  contended: Uint8Array;
}

/** The columns of the page's data; older pages lack some of them. */
export type JobLists = Partial<Record<NumberKey, (number | null)[]> & Record<TextKey, (string | null)[]> & { contended: (boolean | null)[] }> & { job: number[] };

export interface Job {
  job: number; method: number; column: number; problem: number; repetition: number; state: string; status: string | null;
  literal: string | null; strict: string | null; solid: string | null; physical: string | null;
  cost: number | null; wall_us: number | null; cpu_us: number | null; contended: boolean;
  iterations: number | null; restarts: number | null; term_evaluations: number | null;
  failed_waypoint: number | null; detail: string | null;
}
export type Rule = 'literal' | 'strict' | 'solid' | 'physical';

function textColumn(list: (string | null)[] | undefined, length: number): TextColumn {
  const codes = new Uint32Array(length), known = new Map<string | null, number>();
  for (let i = 0; i < length; ++i) {
    const text = list?.[i] ?? null;
    let code = known.get(text);
    if (code === undefined) known.set(text, code = known.size);
    codes[i] = code;
  }
  return { codes, distinct: [...known.keys()] };
}

export function columnsOf(lists: JobLists): JobColumns {
  const length = lists.job.length;
  const numbers = Object.fromEntries(NUMBERS.map((key) => [key, Float64Array.from({ length }, (_, i) => lists[key]?.[i] ?? NaN)]));
  const texts = Object.fromEntries(TEXTS.map((key) => [key, textColumn(lists[key], length)]));
  return { numbers: numbers as JobColumns['numbers'], texts: texts as JobColumns['texts'], contended: Uint8Array.from({ length }, (_, i) => (lists.contended?.[i] ? 1 : 0)) };
}

export class JobTable {
  readonly length: number;

  constructor(readonly columns: JobColumns) { this.length = columns.contended.length; }

  number(key: NumberKey, i: number): number | null {
    const value = this.columns.numbers[key][i];
    return Number.isNaN(value) ? null : value;
  }

  text(key: TextKey, i: number): string | null {
    const { codes, distinct } = this.columns.texts[key];
    return distinct[codes[i]] ?? null;
  }

  contended(i: number): boolean { return this.columns.contended[i] === 1; }

  /** The judge's verdict, or the state of a job without one. */
  verdict(rule: Rule, i: number): string {
    const state = this.text('state', i)!;
    return state === 'done' ? this.text(rule, i) ?? 'done' : state;
  }

  row(i: number): Job {
    const job: Record<string, unknown> = { contended: this.contended(i) };
    for (const key of NUMBERS) job[key] = this.number(key, i);
    for (const key of TEXTS) job[key] = this.text(key, i);
    return job as unknown as Job;
  }

  /** Index of a job; -1 if it is not here. */
  indexOf(job: number): number { return this.columns.numbers.job.indexOf(job); }

  /** Indices of the jobs of one problem. */
  ofProblem(problem: number): number[] {
    const found: number[] = [];
    this.columns.numbers.problem.forEach((one, i) => { if (one === problem) found.push(i); });
    return found;
  }
}
