// Makes pages that no small experiment yields: make_pages.mjs REPORT PROGRAM BLOCKS OLD LARGE. OLD: today's program
// with the blocks of an older release; LARGE: the report with 135,000 jobs and 2,100 problems.
import { readFileSync, writeFileSync } from 'node:fs';
import { gunzipSync, gzipSync } from 'node:zlib';

const [, , report, program, blocks, old, large] = process.argv;
const html = readFileSync(report, 'utf8');
const head = html.slice(0, html.indexOf('<body>'));
writeFileSync(old, `${head}<body><div id="app"></div>\n${readFileSync(blocks, 'utf8')}<script>${readFileSync(program, 'utf8')}</script></body></html>\n`);

const JOBS = 135000, PROBLEMS = 2100, open = 'id="page">', from = html.indexOf(open) + open.length, to = html.indexOf('<', from);
const page = JSON.parse(gunzipSync(Buffer.from(html.slice(from, to), 'base64')));
const { jobs, columns, pairs } = page.experiments[0];
const repeated = (list, count) => Array.from({ length: count }, (_, i) => list[i % list.length]);
for (const key of Object.keys(jobs)) jobs[key] = key === 'job' ? Array.from({ length: JOBS }, (_, i) => i + 1) : repeated(jobs[key], JOBS);

/** A curve with a step for each problem, between the ends of this one. */
function finer(curve) {
  if (!curve || curve.x.length < 2) return curve;
  const between = (list, share) => list[0] + share * (list[list.length - 1] - list[0]);
  const steps = Array.from({ length: PROBLEMS }, (_, i) => i / (PROBLEMS - 1));
  return { x: steps.map((share) => between(curve.x, share ** 3)), y: steps.map((share) => between(curve.y, share)) };
}

for (const figures of [...columns, ...pairs.flatMap((pair) => pair.cells ?? [])]) {
  if (figures.problems) figures.problems = Array.from({ length: PROBLEMS }, (_, i) => i);
  for (const method of figures.methods ?? []) for (const key of Object.keys(method)) method[key] = repeated(method[key], PROBLEMS);
  for (const profile of [figures.profiles.effort, figures.profiles.cost]) if (profile) profile.curves = profile.curves.map(finer);
  figures.efforts = figures.efforts.map(finer);
  figures.costs = figures.costs.map(finer);
}
writeFileSync(large, html.slice(0, from) + gzipSync(JSON.stringify(page)).toString('base64') + html.slice(to));
