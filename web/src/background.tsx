// A thread that holds the page's large lists and works on them, so that the page never waits.
import { Component, type ComponentChildren } from 'preact';
import { useEffect, useState } from 'preact/hooks';
import program from 'program:worker.ts';
import { Store, type Asked } from './store';

type Answer<K extends Asked> = Awaited<ReturnType<Store[K]>>;
interface Question { name: Asked; given: unknown[]; resolve: (value: never) => void; reject: (error: Error) => void }

const open = new Map<number, Question>();
let worker: Worker | null = null, store: Store | null = null, count = 0;

/** Answers in the page's own thread, if no other can be started: the page works, but slower. */
function answerHere(id: number): void {
  store ??= new Store();
  const here = store, { name, given, resolve, reject } = open.get(id)!;
  open.delete(id);
  Promise.resolve().then(() => (here[name] as (...given: unknown[]) => never).apply(here, given)).then(resolve, reject);
}

function start(): void {
  try {
    worker = new Worker(URL.createObjectURL(new Blob([program], { type: 'text/javascript' })));
  } catch {
    store = new Store();
    return;
  }
  worker.onmessage = (event: MessageEvent<{ id: number; value: never; error?: string }>) => {
    const { id, value, error } = event.data, { resolve, reject } = open.get(id)!;
    open.delete(id);
    if (error === undefined) resolve(value); else reject(new Error(error));
  };
  worker.onerror = () => {  // it did not start
    worker = null;
    [...open.keys()].forEach(answerHere);
  };
  worker.onmessageerror = () => {
    for (const { reject } of open.values()) reject(new Error('the browser could not read the page\'s data, perhaps for lack of memory'));
    open.clear();
  };
}

/** Calls a function of the store. */
export function ask<K extends Asked>(name: K, ...given: Parameters<Store[K]>): Promise<Answer<K>> {
  if (!worker && !store) start();
  const id = ++count;
  return new Promise((resolve, reject) => {
    open.set(id, { name, given, resolve: resolve as Question['resolve'], reject });
    if (worker) worker.postMessage([id, name, given]); else answerHere(id);
  });
}

/** Ends the current task, so that the browser handles input and draws. */
export const pause = (): Promise<void> => new Promise((resolve) => { setTimeout(resolve); });

interface Answered<T> { key: string; value?: T | null; error?: unknown }

/**
 * The answer to a question, asked again whenever `depends` changes. `key` names what is asked: until the first answer of
 * this key the result is null, then the newest answer of it. The question receives the former answer of the key. An
 * error is thrown while the view renders, so that ErrorNote shows it.
 */
export function useAnswer<T>(key: string, question: (former: T | null) => Promise<T | null>, depends: unknown[]): T | null {
  const [answer, setAnswer] = useState<Answered<T> | null>(null);
  const former = answer?.key === key ? answer.value ?? null : null;
  useEffect(() => {
    let current = true;
    question(former).then((value) => { if (current) setAnswer({ key, value }); }, (error) => { if (current) setAnswer({ key, error }); });
    return () => { current = false; };
  }, [key, ...depends]);
  if (answer?.key === key && 'error' in answer) throw answer.error;
  return former;
}

/** Shows the reason in place of a view that fails; another `view` begins anew. */
export class ErrorNote extends Component<{ view: string; children: ComponentChildren }, { view?: string; error?: unknown }> {
  static getDerivedStateFromError(error: unknown) { return { error }; }

  static getDerivedStateFromProps({ view }: { view: string }, state: { view?: string }) {
    return state.view === view ? null : { view, error: undefined };
  }

  render() {
    const { error } = this.state;
    return error === undefined ? this.props.children : <p class="note">This view cannot be shown: {error instanceof Error ? error.message : String(error)}</p>;
  }
}
