// A figure with its caption, and its content as SVG and CSV.
import { useEffect, useRef } from 'preact/hooks';
import { csv, save } from './text';
import { ink, paper } from './marks';

type Row = (string | number | null | undefined)[];
interface Props {
  name: string; title: string; caption: string;
  draw: (width: number) => Element;
  rows: () => Row[];
  depends: unknown[];
}

/** The drawing alone, with explicit colours on white, for other programs. */
export function standaloneSvg(holder: Element): string {
  const svg = holder.querySelector('svg')!.cloneNode(true) as SVGSVGElement;
  svg.setAttribute('xmlns', 'http://www.w3.org/2000/svg');
  svg.removeAttribute('class');
  svg.setAttribute('style', `background:${paper()};color:${ink()};font-family:sans-serif`);
  const back = document.createElementNS('http://www.w3.org/2000/svg', 'rect');
  back.setAttribute('width', '100%');
  back.setAttribute('height', '100%');
  back.setAttribute('fill', paper());
  svg.insertBefore(back, svg.firstChild);
  return new XMLSerializer().serializeToString(svg).replace(/currentColor/g, ink());
}

const pending = new Set<() => void>();  // ordered by request
let scheduled = false;

/** Draws after pending input events, one drawing at a time. A drawing that is pending is not added again. */
function soon(draw: () => void): void {
  pending.add(draw);
  if (!scheduled) setTimeout(drawNext);
  scheduled = true;
}

function drawNext(): void {
  const [draw] = pending;  // undefined if the figure is gone
  pending.delete(draw);
  scheduled = pending.size > 0;
  if (scheduled) setTimeout(drawNext);
  draw?.();
}

export function Figure(props: Props) {
  const holder = useRef<HTMLDivElement>(null);
  useEffect(() => {
    const element = holder.current!;
    let seen = false, gone = false;
    const draw = () => {
      if (gone) return;
      const drawn = props.draw(Math.max(280, Math.min(640, element.clientWidth)));
      element.replaceChildren(drawn);
    };
    const observer = new IntersectionObserver((entries) => { if (!seen && entries.some((e) => e.isIntersecting)) { seen = true; soon(draw); } }, { rootMargin: '300px' });
    observer.observe(element);
    let width = element.clientWidth;
    const resized = new ResizeObserver(() => {
      if (!seen || Math.abs(element.clientWidth - width) < 8) return;
      width = element.clientWidth;
      soon(draw);
    });
    resized.observe(element);
    const scheme = matchMedia('(prefers-color-scheme: dark)');
    scheme.addEventListener('change', draw);
    addEventListener('beforeprint', draw);
    return () => {
      gone = true;
      pending.delete(draw);
      observer.disconnect();
      resized.disconnect();
      scheme.removeEventListener('change', draw);
      removeEventListener('beforeprint', draw);
    };
  }, props.depends);
  return (
    <figure class="figure" id={`figure-${props.name}`}>
      <h3>{props.title}</h3>
      <div class="drawing" ref={holder} role="img" aria-label={`${props.title}. ${props.caption}`} />
      <figcaption>{props.caption}
        <span class="tools">
          <button onClick={() => save(`${props.name}.svg`, standaloneSvg(holder.current!), 'image/svg+xml')}>SVG</button>
          <button onClick={() => save(`${props.name}.csv`, csv(props.rows()), 'text/csv')}>CSV</button>
        </span>
      </figcaption>
    </figure>
  );
}
