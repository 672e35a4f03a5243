// The page as sent by `legopt serve`, in a real browser: node --test serve_test.mjs, with SERVED and BY_SERVER
// (address of a finished experiment, read from its file and from a running server), TABLE (of legopt table --format
// json), GROWING (address of a paused one) with GROWING_TABLE and GROWING_STATISTICS (JSON of both tables), RESUME
// (command that resumes it) and BROWSER.
import assert from 'node:assert/strict';
import { execSync } from 'node:child_process';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { chromium } from 'playwright-core';

const PATIENCE_MS = 180000; // the processor renders pictures, and other tests may keep it busy

const { SERVED, BY_SERVER, GROWING, GROWING_TABLE, GROWING_STATISTICS, RESUME, TABLE, BROWSER } = process.env;
const SOURCES = [['quick.sqlite', SERVED], ['the server', BY_SERVER]];
const json = (file) => JSON.parse(readFileSync(file, 'utf8'));
const FLAGS = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
let browser;
before(async () => { browser = await chromium.launch({ executablePath: BROWSER, args: FLAGS }); });
after(() => browser?.close());

async function open(url, address = '', prepare = async () => undefined) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 900 } });
  page.setDefaultTimeout(PATIENCE_MS);
  page.faults = [];
  page.strangers = [];
  page.on('console', (message) => { if (['error', 'warning'].includes(message.type()) && !/GPU stall|GL Driver/.test(message.text())) page.faults.push(message.text()); });
  page.on('pageerror', (error) => page.faults.push(String(error)));
  page.on('request', (request) => { if (!request.url().startsWith(url) && !/^(blob|data):/.test(request.url())) page.strangers.push(request.url()); });
  await prepare(page);
  await page.goto(`${url}${address}`);
  await page.waitForFunction(() => window.legopt?.page);
  return page;
}

async function closeClean(page) {
  assert.deepEqual(page.strangers, []);
  assert.deepEqual(page.faults, []);
  await page.close();
}

for (const [source, address] of SOURCES) {
  test(`${source}: the table is that of legopt table, and two clicks lead to the pair that collides`, async () => {
    const page = await open(address);
    assert.deepEqual(await page.evaluate(() => window.legopt.page.experiments[0].table), json(TABLE));
    await page.getByRole('link', { name: /self collision/ }).first().click();
    await page.locator('.jobs a.job').first().click();
    const pair = page.locator('.colliding li[data-fails="literal"]').first();
    await pair.waitFor();
    assert.match(await pair.textContent(), /\u2194.*mm deep/);
    await page.waitForFunction(() => window.legopt.view?.filled() > 0.05);
    assert.ok((await page.evaluate(() => window.legopt.poseError())) < 1e-6);
    assert.ok((await page.locator('.figure').count()) > 0, 'the trace is drawn');
    await closeClean(page);
  });

  test(`${source}: what is going on: experiments, workers, newest failures, each a link`, async () => {
    const page = await open(address, '#v=live');
    await page.getByRole('heading', { name: `Experiments of ${source}` }).waitFor();
    await page.locator('.newest a').first().click();
    await page.locator('.job-view').waitFor();
    await page.getByRole('link', { name: 'Live' }).click();
    await page.locator('a[aria-current=true]').click();  // the experiment's own address
    await page.waitForFunction(() => location.search === '?experiment=1' && window.legopt?.page);
    await closeClean(page);
  });
}

test('a solution that cannot be loaded is replaced by the reason', async () => {
  const reason = 'job 1, waypoint 0: holds 2 bytes instead of an array of float64';
  const page = await open(SERVED, '#v=job&job=1', (opened) => opened.route('**/blocks/solutions-*', (route) => route.fulfill({ status: 500, body: reason })));
  await page.getByRole('alert').filter({ hasText: reason }).waitFor();
  assert.doesNotMatch(await page.locator('.job-view').textContent(), /No trace was recorded|backup/);
  assert.ok((await page.getByText(`The trace cannot be loaded: the server answered 500: ${reason}`).count()) > 0);
  await page.close();
});

test('an unfinished experiment: the page has the figures of the commands, cell by cell', async () => {
  const page = await open(GROWING), table = json(GROWING_TABLE), statistics = json(GROWING_STATISTICS);
  const experiment = await page.evaluate(() => window.legopt.page.experiments[0]);
  assert.deepEqual(experiment.table, table);
  assert.deepEqual(experiment.statistics, statistics);
  for (const [c, { task, initialization }] of experiment.columns.entries()) {
    for (const [m, row] of table.rows.entries()) {
      const cell = row[task][initialization], line = page.locator(`table[data-column="${c}"] tr[data-method="${m}"]`);
      const n = statistics.rows.find((one) => one.method_id === experiment.methods[m].id && one.task === task && one.initialization === initialization).n;
      const count = await line.locator('td.count').textContent();
      assert.ok(count.startsWith(`${cell.solved}/${cell.n}`), count);
      if (cell.finished < cell.n) assert.ok(count.includes(`${cell.n - cell.finished} left`), count);
      assert.equal((await line.locator('td.wide').textContent()).trim() === '\u2013', n === 0);
      assert.doesNotMatch(await line.locator('td.failures').textContent(), /queued|leased|cancelled/);
      if (cell.solved === cell.finished) assert.equal(await line.locator('a.failed').count(), 0, 'queued is not failed');
    }
    const below = await page.locator('.below').nth(c).textContent(), { complete } = statistics.columns[c];
    assert.match(below, new RegExp(`tests: ${complete} problems? that`));
    if (complete === 0) assert.doesNotMatch(below, /Cochran|same ones/);
  }
  await page.evaluate(() => { location.hash = '#v=jobs&o=queued'; });
  await page.locator('.jobs tbody tr').first().waitFor();
  assert.equal(await page.locator('.jobs tbody tr.bad').count(), 0, 'queued is not failed');
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
  await page.evaluate(() => document.dispatchEvent(new Event('visibilitychange')));  // triggers a new request
  await page.getByRole('alert').waitFor();
  assert.match(await page.getByRole('alert').textContent(), /no longer answers/);
  await page.close();
});
