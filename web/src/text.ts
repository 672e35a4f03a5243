// Numbers and words for users.

export const DASH = '\u2013';
export const INFINITY = '\u221e';

/** Three significant digits, in plain notation if short. */
export function number(value: number | null | undefined): string {
  if (value === null || value === undefined || Number.isNaN(value)) return DASH;
  if (!Number.isFinite(value)) return INFINITY;
  const size = Math.abs(value);
  if (size === 0) return '0';
  if (size >= 1e6 || size < 1e-3) return value.toExponential(1).replace('e+', 'e');
  if (size >= 100) return value.toFixed(0);
  return value.toPrecision(3);
}

/** Milliseconds, or seconds if shorter. 0 is an unknown time. */
export function time(ms: number | null | undefined): string {
  if (ms === null || ms === undefined || ms === 0) return DASH;
  return ms >= 1e4 ? `${number(ms / 1e3)} s` : `${number(ms)} ms`;
}

export function length(m: number | null | undefined): string {
  if (m === null || m === undefined) return DASH;
  return Math.abs(m) < 1 ? `${number(m * 1e3)} mm` : `${number(m)} m`;
}

export function p(value: number): string { return value < 0.001 ? 'p < 0.001' : `p = ${value.toFixed(3)}`; }

export function interval(range: (number | null)[]): string {
  return `[${range.map((v) => (v === null ? INFINITY : number(v))).join(', ')}]`;
}

/** States of jobs that have not ended: they are not counted, and are no failures. */
export const MISSING = ['queued', 'leased', 'cancelled'];

export function words(text: string): string { return text.replace(/_/g, ' '); }

export function csv(rows: (string | number | null | undefined)[][]): string {
  const field = (value: string | number | null | undefined) => {
    const text = value === null || value === undefined ? '' : String(value);
    return /[",\r\n]/.test(text) ? `"${text.replace(/"/g, '""')}"` : text;
  };
  return rows.map((row) => row.map(field).join(',')).join('\r\n') + '\r\n';
}

export function save(name: string, content: BlobPart, type: string): void {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([content], { type }));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
