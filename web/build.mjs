// Bundles src/ into one program, and the licences of what it contains: node build.mjs OUTPUT_FOLDER.
import { build } from 'esbuild';
import { existsSync, mkdirSync, readFileSync, writeFileSync } from 'node:fs';
import { dirname, join } from 'node:path';
import { fileURLToPath } from 'node:url';

const here = dirname(fileURLToPath(import.meta.url));
const out = process.argv[2] ?? join(here, 'dist');
mkdirSync(out, { recursive: true });
const common = { absWorkingDir: here, bundle: true, minify: true, format: 'iife', target: 'es2020', charset: 'ascii', legalComments: 'none' };

// import text from 'program:FILE': src/FILE as a program for a thread.
const threadPrograms = {
  name: 'thread-programs',
  setup(builder) {
    builder.onResolve({ filter: /^program:/ }, ({ path }) => ({ path: path.slice('program:'.length), namespace: 'program' }));
    builder.onLoad({ filter: /.*/, namespace: 'program' }, async ({ path }) => {
      const { outputFiles } = await build({ ...common, entryPoints: [join('src', path)], write: false });
      return { contents: outputFiles[0].text, loader: 'text' };
    });
  },
};

const result = await build({
  ...common,
  entryPoints: ['src/main.tsx'],
  plugins: [threadPrograms],
  loader: { '.css': 'text' },
  jsx: 'automatic',
  jsxImportSource: 'preact',
  metafile: true,
  outfile: join(out, 'page.js'),
});

const packages = new Set();
for (const [output] of Object.entries(result.metafile.outputs)) {
  for (const [input, used] of Object.entries(result.metafile.outputs[output].inputs)) {
    const match = /node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(input);
    if (match && used.bytesInOutput > 0) packages.add(match[1]);
  }
}
let text = 'page.js contains these works; each is followed by its licence.\n';
for (const name of [...packages].sort()) {
  const folder = join(here, 'node_modules', name);
  const about = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf8'));
  const file = ['LICENSE', 'LICENSE.md', 'LICENSE.txt', 'license', 'LICENCE'].find((f) => existsSync(join(folder, f)));
  if (!file) throw new Error(`${name} has no licence file`);
  text += `\n${'-'.repeat(80)}\n${name} ${about.version} (${about.license})\n\n${readFileSync(join(folder, file), 'utf8').trim()}\n`;
}
writeFileSync(join(out, 'THIRD_PARTY_LICENSES'), text);
const bundle = readFileSync(join(out, 'page.js'), 'utf8');
if (/<\/script/i.test(bundle)) throw new Error('the bundle contains </script, which ends a page early');
console.log(`page.js: ${bundle.length} bytes, ${packages.size} packages`);
