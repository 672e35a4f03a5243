// Long tables, of which only the visible rows are drawn, so that 100,000 are fast.
import { Fragment, type ComponentChildren } from 'preact';
import { useEffect, useRef, useState } from 'preact/hooks';

const MARGIN = 4, SHOWN = 30;  // rows beyond the visible ones, and most visible ones
const MOST_PRINTED = 5000;  // rows, some 100 sheets

/** Whether the page is being printed: paper does not scroll. */
function usePrinting(): boolean {
  const [printing, setPrinting] = useState(false);
  useEffect(() => {
    const begin = () => setPrinting(true), end = () => setPrinting(false);
    addEventListener('beforeprint', begin);
    addEventListener('afterprint', end);
    return () => { removeEventListener('beforeprint', begin); removeEventListener('afterprint', end); };
  }, []);
  return printing;
}

interface Props {
  label: string; count: number; height_px: number; span: number; head: ComponentChildren; row: (i: number) => ComponentChildren;
  list: unknown;  // another list begins at its first row
  kind: string; noun: string; hint: string;  // class of the table; plural of a row; how to print fewer
}

/** A table of `count` rows of one height in a box that scrolls. */
export function RowTable({ label, count, height_px, span, head, row, list, kind, noun, hint }: Props) {
  const [top, setTop] = useState(0), holder = useRef<HTMLDivElement>(null), printing = usePrinting();
  useEffect(() => { holder.current?.scrollTo(0, 0); setTop(0); }, [list]);
  const first = printing ? 0 : Math.max(0, Math.min(Math.floor(top / height_px), count) - MARGIN), last = Math.min(count, printing ? MOST_PRINTED : first + 2 * MARGIN + SHOWN);
  const space = (rows: number) => <tr style={{ height: `${rows * height_px}px` }}><td colSpan={span} /></tr>;
  return (
    <>
      <div class="rows" ref={holder} onScroll={(x) => setTop(x.currentTarget.scrollTop)} tabIndex={0} role="region" aria-label={label}>
        <table class={kind} aria-rowcount={count + 1}>
          <thead>{head}</thead>
          <tbody>
            {first > 0 && space(first)}
            {Array.from({ length: last - first }, (_, i) => <Fragment key={first + i}>{row(first + i)}</Fragment>)}
            {last < count && !printing && space(count - last)}
          </tbody>
        </table>
      </div>
      {printing && last < count && <p class="note">{count - last} of {count} {noun} are not printed. {hint}</p>}
    </>
  );
}
