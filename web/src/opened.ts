// Content of a file that a user opens, an archive or a results database, as read by opener.ts.

export interface OpenedMethod { name: string; multi_starts: number; sample_size: number; incremental: boolean; collision: string; hash: string; options: unknown }

export interface OpenedExperiment {
  id: number; name: string; dataset: { name: string; hash: string }; rule: string; seed: number; repetitions: number; build_ids: string;
  methods: OpenedMethod[]; columns: { task: string; initialization: string }[];
  jobs: Record<string, (string | number | null)[]> & { job: number[] };  // columns of the page's data
  /** The waypoints of a job, with time stamps as in the file; empty: none. */
  solution: (job: number) => number[][];
}

export interface OpenedFile { kind: 'archive' | 'database'; facts: [string, string][]; experiments: OpenedExperiment[] }

/** The program that reads files; only viewer.html has it. */
export interface Opener { read: (name: string, bytes: Uint8Array) => Promise<OpenedFile> }
