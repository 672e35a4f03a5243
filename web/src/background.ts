// A thread that holds the page's large lists and works on them, so that the page never waits.
import { useEffect, useState } from 'preact/hooks';
import program from 'program:worker.ts';
import { Store, type Asked } from './store';

type Answer<K extends Asked> = Awaited<ReturnType<Store[K]>>;
interface Question { name: Asked; given: unknown[]; resolve: (value: never) => void; reject: (error: Error) => void }

const open = new Map<number, Question>();
let worker: Worker | null = null, store: Store | null = null, count = 0;

/** Answers in this thread, as where the policy of a site forbids others: the page works, but slower. */
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

/**
 * The answer to a question, asked again whenever `depends` changes. `key` names what is asked: until the first answer of
 * this key the result is null, then the newest answer of it.
 */
export function useAnswer<T>(key: string, question: () => Promise<T>, depends: unknown[]): T | null {
  const [answer, setAnswer] = useState<{ key: string; value: T } | null>(null);
  useEffect(() => {
    let current = true;
    question().then((value) => { if (current) setAnswer({ key, value }); });
    return () => { current = false; };
  }, [key, ...depends]);
  return answer?.key === key ? answer.value : null;
}
