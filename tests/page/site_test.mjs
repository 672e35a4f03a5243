// The website of archives: node --test site_test.mjs, with SITE (its folder, of the archives "forces" and "traps" and a
// damaged one), DATABASE (results of "forces") and BROWSER.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { chromium } from 'playwright-core';

const PATIENCE_MS = 180000; // the processor renders pictures, and other tests may keep it busy

const { SITE, DATABASE, BROWSER } = process.env;
const ARCHIVE = join(SITE, 'archives', 'forces.legopt-archive');
let browser;
before(async () => { browser = await chromium.launch({ executablePath: BROWSER, args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'] }); });
after(() => browser?.close());

async function open(file) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 1000 } });
  page.setDefaultTimeout(PATIENCE_MS);
  page.faults = [];
  page.on('console', (message) => { if (['error', 'warning'].includes(message.type()) && !/GPU stall|GL Driver/.test(message.text())) page.faults.push(message.text()); });
  page.on('pageerror', (error) => page.faults.push(String(error)));
  await page.goto(`file://${join(SITE, file)}`);
  await page.waitForFunction(() => window.legopt?.page);
  return page;
}

async function closeClean(page) {
  assert.deepEqual(page.faults, []);
  await page.close();
}

/** Lines of leaderboard.csv as objects; no field has a comma. */
function leaderboard() {
  const [head, ...lines] = readFileSync(join(SITE, 'leaderboard.csv'), 'utf8').trim().split(/\r?\n/).map((line) => line.split(','));
  return lines.map((line) => Object.fromEntries(head.map((key, i) => [key, line[i]])));
}

test('a leaderboard has the figures of its CSV, of all problems of the dataset', async () => {
  const page = await open('index.html');
  const [line] = leaderboard().filter((one) => one.tier === 'hands');
  assert.equal(line.problems, '100');  // the archive has four of them
  const row = page.locator('[data-tier=hands] tbody tr');
  assert.equal(await row.count(), 1);
  assert.equal(await row.locator('.count a').textContent(), `${Number(line.solved)}/100`);
  assert.equal(await row.locator('.count .flag').textContent(), '4 given');
  assert.equal(await page.locator('[data-tier=traps] tbody .count a').textContent(), '0/20');
  assert.match(await page.locator('[data-tier=classic]').textContent(), /No archive yet/);
  assert.match(await page.locator('footer').textContent(), /damaged\.legopt-archive is left out: hash: is not that of the content/);
  await closeClean(page);
});

test('three clicks lead from the archives to a picture of a violated constraint', async () => {
  const page = await open('index.html#v=archives');
  await page.locator('section', { hasText: "experiment 'forces'" }).getByRole('link', { name: 'tables, figures, 3D' }).click();  // 1
  await page.locator('a.failed').first().click();  // 2
  await page.locator('a.job').first().click();  // 3
  await page.waitForFunction(() => window.legopt?.view?.filled() > 0.01);
  assert.ok(await page.locator('.findings .bad').count() > 0);
  await page.getByRole('link', { name: 'All archives' }).click();
  await page.waitForFunction(() => document.querySelector('[data-tier=hands]'));
  await closeClean(page);
});

test('a problem lists all rows with their solutions', async () => {
  const page = await open('index.html');
  await page.locator('[data-tier=hands]').getByRole('link', { name: 'each problem' }).click();
  await page.getByRole('link', { name: '28', exact: true }).click();
  await page.locator('h2', { hasText: 'Problem 28' }).waitFor();
  const rows = page.locator('table.lines tbody tr');
  assert.equal(await rows.count(), 1);
  await rows.getByRole('link', { name: '3D' }).click();
  await page.waitForFunction(() => window.legopt?.view?.filled() > 0.01);
  assert.match(await page.locator('h2').first().textContent(), /posture 28/);
  await closeClean(page);
});

async function lookAround(page, jobs) {
  await page.locator('table.lines tbody').getByRole('link').first().click();  // of the counts
  await page.locator('.says', { hasText: `${jobs} of ${jobs} jobs` }).waitFor();
  await page.locator('a.job').first().click();
  await page.waitForFunction(() => window.legopt?.view?.filled() > 0.01);
  assert.match(await page.locator('main').textContent(), /verdict of the file.*Not judged here/s);
}

test('the viewer opens an archive and a database without a server', async () => {
  const page = await open('viewer.html');
  for (const file of [ARCHIVE, DATABASE]) {
    await page.locator('input[type=file]').setInputFiles(file);
    await page.waitForFunction((name) => document.querySelector('h1').textContent.includes(name), file.split('/').pop());
    assert.match(await page.locator('.note').first().textContent(), /Nothing was judged here/);
    await lookAround(page, 4);
  }
  await closeClean(page);
});

test('a file can be dropped; a damaged or foreign one is named', async () => {
  const page = await open('viewer.html');
  await page.locator('input[type=file]').waitFor();
  const drop = (name, bytes) => page.evaluate(([title, list]) => {
    const data = new DataTransfer();
    data.items.add(new File([new Uint8Array(list)], title));
    window.dispatchEvent(new DragEvent('drop', { dataTransfer: data }));
  }, [name, [...bytes]]);
  const bytes = readFileSync(ARCHIVE), changed = Buffer.from(bytes);
  changed[changed.length - 5] ^= 1;
  const old = readFileSync(DATABASE);
  old[63] = 9;  // its schema version
  const newer = Buffer.from(bytes.toString('latin1').replace('legopt-archive 1', 'legopt-archive 2'), 'latin1');
  for (const [name, content, reason] of [['changed', changed, /another hash/], ['short', bytes.subarray(0, 40), /cut off/], ['newer', newer, /has format 2; this page reads 1/], ['text', Buffer.from('hello'), /neither an archive/],
    ['old.sqlite', old, /of schema \d+ \(it has 9\)/]]) {
    await drop(name, content);
    await page.waitForFunction((title) => document.querySelector('.flagged')?.textContent.startsWith(`${title} cannot be read`), name);
    assert.match(await page.locator('.flagged').textContent(), reason);
  }
  await drop('forces.legopt-archive', bytes);
  await page.waitForFunction(() => document.querySelector('h1').textContent.includes('forces.legopt-archive'));
  await lookAround(page, 4);
  await closeClean(page);
});
