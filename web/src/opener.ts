// Reads archives and results databases in the browser. A program of its own, because SQLite is large.
import { readArchive } from './opener_archive';
import { readDatabase } from './opener_database';
import type { Opener } from './opened';

const text = new TextDecoder('latin1');

const opener: Opener = {
  async read(_name, bytes) {
    const head = text.decode(bytes.subarray(0, 16));
    if (head.startsWith('legopt-archive ')) return readArchive(bytes);
    if (head === 'SQLite format 3\0') return readDatabase(bytes);
    throw new Error('it is neither an archive of legopt nor a results database');
  },
};
(window as unknown as { legoptOpener: Opener }).legoptOpener = opener;
