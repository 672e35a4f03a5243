// Runs a store in a thread of its own. A message is [number, function, arguments]; its answer has the same number.
import { Store, type Asked } from './store';

const store = new Store();

onmessage = async (event: MessageEvent<[number, Asked, unknown[]]>) => {
  const [id, name, given] = event.data;
  try {
    const value: unknown = await (store[name] as (...given: unknown[]) => unknown).apply(store, given);
    postMessage({ id, value });
  } catch (error) {
    postMessage({ id, error: error instanceof Error ? error.message : String(error) });
  }
};
