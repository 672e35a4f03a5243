// The page's large lists, which the background holds (background.tsx): a view asks for the part that it shows.
import type { Column, ColumnFigures, Curve, Effort, Experiment, MethodValues, Page, Pair, PairFigures, Profile } from './data';
import { jobsCsv, outcomesOf, select, type Choice, type JobNames } from './job_selection';
import { JobTable, columnsOf, type JobColumns, type JobLists } from './job_table';

export const FORMAT = 2;

/** Values of a method in pages before those of work. */
interface TimeValues { time_ms: (number | null)[]; time_ratio: (number | null)[] }
type SentValues = Omit<MethodValues, 'effort_ms' | 'effort_ratio'> & (MethodValues | TimeValues);
/** Figures of the page's data. Older pages have times instead of efforts; a pair within an experiment has only curves. */
interface SentFigures {
  limit_ms: number; complete?: number; effort?: Effort; problems?: number[]; methods?: SentValues[];
  profiles: { effort?: Profile | null; time?: Profile | null; cost: Profile | null };
  efforts?: (Curve | null)[]; runtimes?: (Curve | null)[]; costs: (Curve | null)[];
}
interface WholePair extends Pair { report?: PairFigures['report']; cells?: SentFigures[] }
export interface WholeExperiment extends Omit<Experiment, 'columns' | 'pairs' | 'jobs'> { columns: (Column & SentFigures)[]; pairs: WholePair[]; jobs: JobLists }
export interface WholePage extends Omit<Page, 'experiments' | 'across'> { experiments?: WholeExperiment[]; across?: WholePair[] }

/** A page as the background sends it: the columns of jobs become tables where they arrive. */
export interface SentPage extends Omit<Page, 'experiments'> { experiments?: (Omit<Experiment, 'jobs'> & { jobs: JobColumns })[] }

/** The content of a block: gzip, or its base64. */
export async function unpacked(block: ArrayBuffer | string): Promise<ArrayBuffer> {
  let bytes: Uint8Array<ArrayBuffer>;
  if (typeof block === 'string') {
    const text = atob(block);
    bytes = new Uint8Array(text.length);
    for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  } else {
    bytes = new Uint8Array(block);
  }
  return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream('gzip'))).arrayBuffer();
}

const typedCurve = (curve: Curve | null): Curve | null => curve && { x: Float64Array.from(curve.x), y: Float64Array.from(curve.y) };

const valuesOf = (sent: SentValues): MethodValues => ('effort_ms' in sent ? sent : { ...sent, effort_ms: sent.time_ms, effort_ratio: sent.time_ratio });

/** Figures in today's form. `values`: figures whose problems and methods are used if `sent` has none. */
function figuresOf(sent: SentFigures, values?: ColumnFigures): ColumnFigures {
  const profile = (one: Profile | null) => one && { ...one, curves: one.curves.map(typedCurve) };
  const effort = sent.effort ?? 'time', { problems, methods, methods_effort } = values ?? { problems: sent.problems!, methods: sent.methods!.map(valuesOf), methods_effort: effort };
  return {
    limit_ms: sent.limit_ms, complete: sent.complete, problems, methods, methods_effort, effort,
    profiles: { effort: profile(sent.profiles.effort ?? sent.profiles.time ?? null), cost: profile(sent.profiles.cost) },
    efforts: (sent.efforts ?? sent.runtimes!).map(typedCurve), costs: sent.costs.map(typedCurve),
  };
}

const namesOf = ({ rule, methods, columns }: WholeExperiment): JobNames => ({
  rule, methods: methods.map(({ choice }) => ({ choice })), columns: columns.map(({ task, initialization }) => ({ task, initialization })),
});

interface Kept { columns: ColumnFigures[]; pairs: WholePair[]; jobs: JobTable; names: JobNames }

export class Store {
  private version = 0;
  private experiments: Kept[] = [];
  private across: WholePair[] = [];

  /** Reads the block "page". The other functions use the page that was read last. */
  async page(block: ArrayBuffer | string): Promise<SentPage> {
    return this.open(JSON.parse(new TextDecoder().decode(await unpacked(block))) as WholePage);
  }

  /** Takes a page that is read already. */
  open(page: WholePage): SentPage {
    if (page.format > FORMAT) throw new Error(`this file has format ${page.format}; its program reads up to ${FORMAT}`);
    ++this.version;
    this.across = page.across ?? [];
    this.experiments = (page.experiments ?? []).map((e) => ({ columns: e.columns.map((column) => figuresOf(column)), pairs: e.pairs, jobs: new JobTable(columnsOf(e.jobs)), names: namesOf(e) }));
    const short = ({ a, b, refused }: WholePair): Pair => ({ a, b, refused });
    return {
      ...page, version: this.version, across: page.across?.map(short),
      experiments: page.experiments?.map((e, i) => ({
        ...e, jobs: this.experiments[i].jobs.columns, outcomes: outcomesOf(this.experiments[i].jobs, e.rule), pairs: e.pairs.map(short),
        columns: e.columns.map(({ task, initialization, title, causes }) => ({ task, initialization, title, causes })),
      })),
    };
  }

  column(e: number, c: number): ColumnFigures { return this.experiments[e].columns[c]; }

  /** A pair of methods of one experiment; the values of its problems are those of the experiment's columns. */
  pair(e: number, i: number): PairFigures {
    const { pairs, columns, names } = this.experiments[e], { a, b, report, cells } = pairs[i];
    const whole = report!.comparisons.map(({ task, initialization }, k) => {
      const column = columns[names.columns.findIndex((c) => c.task === task && c.initialization === initialization)];
      return figuresOf(cells![k], { ...column, methods: [column.methods[a], column.methods[b]] });
    });
    return { report: report!, cells: whole };
  }

  acrossPair(i: number): PairFigures {
    const { report, cells } = this.across[i];
    return { report: report!, cells: cells!.map((cell) => figuresOf(cell)) };
  }

  /** Indices of jobs; null if the view has an older page. */
  jobs(version: number, e: number, choice: Choice): Uint32Array | null {
    if (version !== this.version) return null;
    const { jobs, names } = this.experiments[e];
    return select(jobs, names.rule, choice);
  }

  jobsCsv(e: number, order: Uint32Array): string {
    const { jobs, names } = this.experiments[e];
    return jobsCsv(jobs, names, order);
  }
}

/** Functions of a store, as they are called from another thread. */
export type Asked = 'page' | 'open' | 'column' | 'pair' | 'acrossPair' | 'jobs' | 'jobsCsv';
