// The shown state, in the address: every view can be bookmarked, shared and revisited.
import { useEffect, useState } from 'preact/hooks';

export type State = Record<string, string>;

function parse(): State {
  const state: State = {};
  new URLSearchParams(location.hash.slice(1)).forEach((value, key) => { state[key] = value; });
  return state;
}

/** The address of a state: the current one with `changes`; undefined removes a key. */
export function href(changes: Record<string, string | number | undefined>, from: State = parse()): string {
  const next = new URLSearchParams();
  for (const [key, value] of Object.entries({ ...from, ...changes })) {
    if (value !== undefined && value !== '') next.set(key, String(value));
  }
  return `#${next.toString()}`;
}

/** Goes to a state; `quietly`: without a step of the history. */
export function go(changes: Record<string, string | number | undefined>, quietly = false): void {
  const to = href(changes);
  if (to === location.hash) return;
  if (quietly) {
    history.replaceState(null, '', to);
    dispatchEvent(new HashChangeEvent('hashchange'));
  } else {
    location.hash = to;
  }
}

export function useAddress(): State {
  const [state, setState] = useState(parse());
  useEffect(() => {
    const changed = () => setState(parse());
    addEventListener('hashchange', changed);
    changed();  // the address may have changed since the first drawing
    return () => removeEventListener('hashchange', changed);
  }, []);
  return state;
}
