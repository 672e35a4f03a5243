// Makes pages that no small experiment yields: make_pages.mjs REPORT PROGRAM BLOCKS OLD LARGE. OLD: today's program
// with the blocks of an older release; LARGE: the report with 100,000 jobs.
import { readFileSync, writeFileSync } from 'node:fs';
import { gunzipSync, gzipSync } from 'node:zlib';

const [, , report, program, blocks, old, large] = process.argv;
const html = readFileSync(report, 'utf8');
const head = html.slice(0, html.indexOf('<body>'));
writeFileSync(old, `${head}<body><div id="app"></div>\n${readFileSync(blocks, 'utf8')}<script>${readFileSync(program, 'utf8')}</script></body></html>\n`);

const JOBS = 100000, open = 'id="page">', from = html.indexOf(open) + open.length, to = html.indexOf('<', from);
const page = JSON.parse(gunzipSync(Buffer.from(html.slice(from, to), 'base64')));
const { jobs } = page.experiments[0];
const count = jobs.job.length;
for (const key of Object.keys(jobs)) {
  const column = jobs[key];
  jobs[key] = Array.from({ length: JOBS }, (_, i) => (key === 'job' ? i + 1 : column[i % count]));
}
writeFileSync(large, html.slice(0, from) + gzipSync(JSON.stringify(page)).toString('base64') + html.slice(to));
