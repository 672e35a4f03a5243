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

// page.js: the page. opener.js: reads files that a user opens, only for viewer.html.
const programs = { 'page.js': 'src/main.tsx', 'opener.js': 'src/opener.ts' };
const packages = new Set();
for (const [name, source] of Object.entries(programs)) {
  const { metafile } = await build({
    ...common,
    entryPoints: [source],
    plugins: [threadPrograms],
    loader: { '.css': 'text', '.sql': 'text' },
    external: ['fs', 'path', 'crypto', 'node:fs', 'node:fs/promises', 'node:module', 'node:url', 'node:path', 'node:crypto'],  // sql.js: in Node only
    jsx: 'automatic',
    jsxImportSource: 'preact',
    metafile: true,
    outfile: join(out, name),
  });
  for (const output of Object.values(metafile.outputs)) {
    for (const [input, used] of Object.entries(output.inputs)) {
      const match = /node_modules\/((?:@[^/]+\/)?[^/]+)\//.exec(input);
      if (match && used.bytesInOutput > 0) packages.add(match[1]);
    }
  }
}
let text = 'page.js and opener.js contain these works; each is followed by its licence.\n';
for (const name of [...packages].sort()) {
  const folder = join(here, 'node_modules', name);
  const about = JSON.parse(readFileSync(join(folder, 'package.json'), 'utf8'));
  const file = ['LICENSE', 'LICENSE.md', 'LICENSE.txt', 'license', 'LICENCE'].find((f) => existsSync(join(folder, f)));
  if (!file) throw new Error(`${name} has no licence file`);
  text += `\n${'-'.repeat(80)}\n${name} ${about.version} (${about.license})\n\n${readFileSync(join(folder, file), 'utf8').trim()}\n`;
}
writeFileSync(join(out, 'THIRD_PARTY_LICENSES'), text);
for (const name of Object.keys(programs)) {
  const bundle = readFileSync(join(out, name), 'utf8');
  if (/<\/script/i.test(bundle)) throw new Error(`${name} contains </script, which ends a page early`);
  console.log(`${name}: ${bundle.length} bytes`);
}
console.log(`${packages.size} packages`);
