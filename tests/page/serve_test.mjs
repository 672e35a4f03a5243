// The page as `legopt serve` sends it, in a real browser: node --test serve_test.mjs, with SERVED (address of a finished
// experiment), TABLE (of legopt table --format json), GROWING (address of one that is paused), RESUME (command that lets
// it go on) and BROWSER.
import assert from 'node:assert/strict';
import { execSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { chromium } from 'playwright-core';

const { SERVED, GROWING, RESUME, TABLE, BROWSER } = process.env;
const FLAGS = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
let browser;
before(async () => { browser = await chromium.launch({ executablePath: BROWSER, args: FLAGS }); });
after(() => browser?.close());

async function open(url, address = '', prepare = async () => undefined) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 900 } });
  page.faults = [];
  page.strangers = [];
  page.on('console', (message) => { if (['error', 'warning'].includes(message.type()) && !/GPU stall|GL Driver/.test(message.text())) page.faults.push(message.text()); });
  page.on('pageerror', (error) => page.faults.push(String(error)));
  page.on('request', (request) => { if (!request.url().startsWith(url) && !/^(blob|data):/.test(request.url())) page.strangers.push(request.url()); });
  await prepare(page);
  await page.goto(`${url}${address}`);
  await page.waitForFunction(() => window.legopt?.page, null, { timeout: 60000 });
  return page;
}

async function closeClean(page) {
  assert.deepEqual(page.strangers, []);
  assert.deepEqual(page.faults, []);
  await page.close();
}

test('the table is that of legopt table, and two clicks lead to the pair that collides', async () => {
  const page = await open(SERVED);
  assert.deepEqual(await page.evaluate(() => window.legopt.page.experiments[0].table), JSON.parse(readFileSync(TABLE, 'utf8')));
  await page.getByRole('link', { name: /self collision/ }).first().click();
  await page.locator('.jobs a.job').first().click();
  const pair = page.locator('.colliding li[data-fails="literal"]').first();
  await pair.waitFor();
  assert.match(await pair.textContent(), /\u2194.*mm deep/);
  await page.waitForFunction(() => window.legopt.view?.filled() > 0.05, null, { timeout: 60000 });
  assert.ok((await page.evaluate(() => window.legopt.poseError())) < 1e-6);
  await closeClean(page);
});

test('what is going on: experiments, workers, newest failures, each a link', async () => {
  const page = await open(SERVED, '#v=live');
  await page.getByRole('heading', { name: /Experiments of quick.sqlite/ }).waitFor();
  await page.locator('.newest a').first().click();
  await page.locator('.job-view').waitFor();
  await page.getByRole('link', { name: 'Live' }).click();
  await page.locator('a[aria-current=true]').click();  // the experiment's own address
  await page.waitForFunction(() => location.search === '?experiment=1' && window.legopt?.page);
  await closeClean(page);
});

test('an experiment that runs comes to its end on the page, without a reload', async () => {
  const page = await open(GROWING);
  const begin = await page.evaluate(() => window.legopt.page.experiments[0].unfinished);
  assert.ok(begin > 0, 'it was over before the browser came');
  await page.locator('.flagged', { hasText: 'UNFINISHED' }).waitFor();
  await page.locator('.live progress').waitFor();
  await page.evaluate(() => { window.same = true; });
  execSync(RESUME);
  await page.waitForFunction(() => window.legopt.page.experiments[0].unfinished === 0, null, { timeout: 240000 });
  assert.equal(await page.evaluate(() => window.same), true);
  assert.equal(await page.locator('.flagged', { hasText: 'UNFINISHED' }).count(), 0);
  assert.match(await page.locator('.live').textContent(), /done: (\d+) of \1 jobs/);
  await closeClean(page);
});

test('without a stream it polls', async () => {
  const page = await open(SERVED, '#v=live', (opened) => opened.route('**/events', (route) => route.fulfill({ status: 503 })));
  await page.getByRole('heading', { name: /Experiments of/ }).waitFor();
  await page.waitForResponse((response) => response.url().endsWith('/state'));
  assert.deepEqual(page.faults.filter((fault) => !/503/.test(fault)), []);
  await page.close();
});

test('when the server is gone, it says so', async () => {
  const page = await open(SERVED, '#v=live');
  await page.getByRole('heading', { name: /Experiments of/ }).waitFor();
  await page.route('**/*', (route) => route.abort());
  await page.evaluate(() => document.dispatchEvent(new Event('visibilitychange')));  // asks anew
  await page.getByRole('alert').waitFor();
  assert.match(await page.getByRole('alert').textContent(), /Nothing comes from the server/);
  await page.close();
});
