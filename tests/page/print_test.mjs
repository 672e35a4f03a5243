// Each view on paper: node --test print_test.mjs, with PAGE (a report), VIEW (of a motion), LARGE_PAGE (of
// make_pages.mjs) and BROWSER. The text of the PDF must contain everything on the screen, or the number of omitted
// rows. Needs pdftotext.
import assert from 'node:assert/strict';
import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { chromium } from 'playwright-core';

const PATIENCE_MS = 180000; // the processor renders pictures, and other tests may keep it busy

const { PAGE, VIEW, LARGE_PAGE, BROWSER } = process.env;
const FLAGS = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
const folder = mkdtempSync(join(tmpdir(), 'print-'));
let browser;
before(async () => { browser = await chromium.launch({ executablePath: BROWSER, args: FLAGS }); });
after(() => { browser?.close(); rmSync(folder, { recursive: true, force: true }); });

const bare = (text) => text.normalize('NFKC').replace(/[\s\u00ad]+/g, '');

async function open(file, address) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 900 } });
  page.setDefaultTimeout(PATIENCE_MS);
  await page.goto(`file://${file}${address}`);
  await page.waitForFunction(() => window.legopt?.page);
  return page;
}

/** Returns the text of the printed page without white space, since lines are broken differently on paper. */
async function printed(page) {
  const path = join(folder, 'page.pdf');
  await page.pdf({ path, format: 'A4', landscape: true });
  return bare(execFileSync('pdftotext', ['-raw', path, '-'], { encoding: 'utf8', maxBuffer: 1 << 28 }));
}

/** Returns every text on the screen except clickable controls; of a choice, the selected option. */
const shown = (page) => page.evaluate(() => {
  const controls = 'nav, .bar > button, .tools, .caption > button, .says > button, option, .jobs tbody, script, style, .live';
  const texts = [], walker = document.createTreeWalker(document.getElementById('app'), NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const { parentElement, textContent } = walker.currentNode;
    const sorted = /[\u25b4\u25be]/.test(textContent);  // the sign of the sorted column
    if (!textContent.trim() || sorted || parentElement.closest(controls) || parentElement.getClientRects().length === 0) continue;
    if (parentElement.closest('details:not([open])') && !parentElement.closest('summary')) continue;
    texts.push(textContent);
  }
  document.querySelectorAll('select').forEach((select) => { if (select.getClientRects().length > 0) texts.push(select.selectedOptions[0]?.textContent ?? ''); });
  return texts;
});

async function assertPrinted(page, what) {
  await page.waitForTimeout(300);
  const screen = await shown(page), paper = await printed(page);
  assert.ok(screen.length > 5, `${what}: ${screen.length} texts`);
  const lost = screen.filter((text) => !paper.includes(bare(text)));
  assert.deepEqual(lost, [], `${what} loses on paper`);
  return paper;
}

for (const view of ['table', 'profiles', 'compare', 'map', 'jobs', 'about']) {
  test(`${view}: all that the screen shows is on paper`, async () => {
    const page = await open(PAGE, `#v=${view}`);
    await page.locator('main').waitFor();
    if (['profiles', 'compare'].includes(view)) await page.locator('.drawing svg').first().waitFor();
    await assertPrinted(page, view);
    await page.close();
  });
}

test('jobs: every row is on paper', async () => {
  const page = await open(PAGE, '#v=jobs');
  await page.locator('a.job').first().waitFor();
  const rows = await page.evaluate(() => {
    const { methods, columns } = window.legopt.page.experiments[0];
    return window.legopt.jobs(0).map(({ method, column, problem }) => `${methods[method].choice}${columns[column].task}, ${columns[column].initialization.replace(/_/g, ' ')}${problem}`);
  });
  const paper = await printed(page);
  assert.ok(rows.length > 100);
  assert.deepEqual(rows.filter((row) => !paper.includes(bare(row))), []);
  await page.close();
});

test('jobs: more than can be printed are counted', async () => {
  const page = await open(LARGE_PAGE, '#v=jobs');
  await page.locator('a.job').first().waitFor();
  assert.match(await printed(page), /130000of135000jobsarenotprinted/);
  await page.close();
});

test('a job: its findings are on paper, with the colliding pair', async () => {
  const page = await open(PAGE, '#v=jobs');
  await page.locator('a.job').first().waitFor();
  const job = await page.evaluate(() => {
    const chunks = window.legopt.page.chunks.flat();
    return window.legopt.jobs(0).find(({ job, literal }) => literal === 'self_collision' && chunks.some(([, j]) => j === job))?.job;
  });
  assert.ok(job, 'no job fails by a self collision');
  await page.evaluate((id) => { location.hash = `#v=job&job=${id}`; }, job);
  const pair = page.locator('.colliding li').first();
  await pair.waitFor();
  await page.waitForFunction(() => window.legopt.view?.filled() > 0.05);
  const text = await pair.textContent();
  assert.match(text, /\u2194/);
  const paper = await assertPrinted(page, `job ${job}`);
  assert.ok(paper.includes(bare(text)), text);
  await page.close();
});

test('a motion alone is on paper', async () => {
  const page = await open(VIEW, '');
  await page.waitForFunction(() => window.legopt.view?.filled() > 0.05);
  await assertPrinted(page, 'the view');
  await page.close();
});
