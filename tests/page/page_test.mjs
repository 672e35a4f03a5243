// The page in a real browser: node --test page_test.mjs, with PAGE, TABLE (of legopt table --format json), VIEW (of a
// motion), OLD_PAGE and LARGE_PAGE (of make_pages.mjs) and BROWSER. scripts/check-page makes them.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { chromium } from 'playwright-core';

const PATIENCE_MS = 180000; // the processor renders pictures, and other tests may keep it busy

const { PAGE, TABLE, VIEW, OLD_PAGE, LARGE_PAGE, BROWSER } = process.env;
const FLAGS = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
let browser;
before(async () => { browser = await chromium.launch({ executablePath: BROWSER, args: FLAGS }); });
after(() => browser?.close());

/** Opens a page and collects all errors on it. */
async function open(file, address = '', options = {}) {
  const page = await (options.browser ?? browser).newPage({ viewport: { width: 1280, height: 900 }, ...options.page });
  page.setDefaultTimeout(PATIENCE_MS);
  page.faults = [];
  page.requests = [];
  page.on('console', (message) => { if (['error', 'warning'].includes(message.type()) && !/GPU stall|GL Driver/.test(message.text())) page.faults.push(message.text()); });
  page.on('pageerror', (error) => page.faults.push(String(error)));
  page.on('request', (request) => { if (!/^(file|blob|data):/.test(request.url())) page.requests.push(request.url()); });
  if (options.script) await page.addInitScript(options.script);
  await page.goto(`file://${file}${address}`);
  await page.waitForFunction(() => window.legopt?.page);
  return page;
}

async function closeClean(page) {
  assert.deepEqual(page.requests, []);
  assert.deepEqual(page.faults, []);
  await page.close();
}

const filled = (page) => page.waitForFunction(() => window.legopt.view?.filled() > 0.05);

test('the table is that of legopt table, cell by cell', async () => {
  const table = JSON.parse(readFileSync(TABLE, 'utf8'));
  const page = await open(PAGE);
  const shown = await page.evaluate(() => window.legopt.page.experiments[0].table);
  assert.deepEqual(shown, table);
  const columns = await page.evaluate(() => window.legopt.page.experiments[0].columns.map(({ task, initialization }) => ({ task, initialization })));
  for (const [c, { task, initialization }] of columns.entries()) {
    for (const [m, row] of table.rows.entries()) {
      const cell = row[task][initialization];
      const text = await page.locator(`table[data-column="${c}"] tr[data-method="${m}"] td.count > a`).textContent();
      assert.equal(text, `${cell.solved}/${cell.n}`);
      const cost = await page.locator(`table[data-column="${c}"] tr[data-method="${m}"] td.figure-cell`).first().textContent();
      if (cell.cost === null) assert.equal(cost, '\u2013');
      else assert.ok(Math.abs(Number(cost) - cell.cost) <= 0.006 * cell.cost, `${cost} for ${cell.cost}`);
    }
  }
  await closeClean(page);
});

test('two clicks lead from a failed cell to the pair that collides', async () => {
  const page = await open(PAGE);
  await page.getByRole('link', { name: /self collision/ }).first().click();
  await page.locator('.jobs a.job').first().click();
  const pair = page.locator('.colliding li[data-fails="literal"]').first();
  await pair.waitFor();
  assert.match(await pair.textContent(), /\u2194.*mm deep/);
  await filled(page);
  await closeClean(page);
});

test('link poses are those of the judge', async () => {
  const page = await open(PAGE);
  assert.ok((await page.evaluate(() => window.legopt.poseError())) < 1e-6);
  await closeClean(page);
});

test('a motion plays, and the canvas shows something else than its background', async () => {
  const page = await open(VIEW);
  await filled(page);
  await page.getByRole('button', { name: 'play' }).click();
  const slider = page.getByRole('slider', { name: 'waypoint' });
  const start = await slider.inputValue();
  await page.waitForFunction((from) => document.querySelector('input[type=range]').value !== from, start);
  await closeClean(page);
});

test('keys turn, move and zoom the 3D view, and its label says so', async () => {
  const page = await open(VIEW);
  await filled(page);
  const canvas = page.locator('canvas');
  for (const word of ['arrow keys', 'Shift', 'zoom', 'Home']) assert.ok((await canvas.getAttribute('aria-label')).includes(word), word);
  await canvas.focus();
  const state = () => page.evaluate(() => { const [x, y, z, ...target] = window.legopt.view.cameraState(); return { eye: [x, y, z], target, distance: Math.hypot(x - target[0], y - target[1], z - target[2]) }; });
  const press = async (key) => { const before = await state(); await page.keyboard.press(key); return [before, await state()]; };
  const near = (a, b) => a.every((v, i) => Math.abs(v - b[i]) < 1e-6);
  const scrolled = await page.evaluate(() => scrollY);
  await page.keyboard.press('Home');
  const home = await state();
  for (const key of ['ArrowLeft', 'ArrowRight', 'ArrowUp', 'ArrowDown']) {
    const [before, now] = await press(key);
    assert.ok(near(before.target, now.target) && !near(before.eye, now.eye), key);
    assert.ok(Math.abs(before.distance - now.distance) < 1e-6, key);
  }
  for (const key of ['Shift+ArrowLeft', 'Shift+ArrowUp']) {
    const [before, now] = await press(key);
    assert.ok(!near(before.target, now.target) && Math.abs(before.distance - now.distance) < 1e-6, key);
  }
  for (const [key, closer] of [['+', true], ['-', false]]) {
    const [before, now] = await press(key);
    assert.equal(now.distance < before.distance, closer, key);
  }
  await page.keyboard.press('Home');
  const again = await state();
  assert.ok(near(home.target, again.target) && near(home.eye, again.eye), 'Home resets the view');
  assert.equal(await page.evaluate(() => scrollY), scrolled, 'the page does not scroll');
  await closeClean(page);
});

test('a view opens at the violation that decided the verdict', async () => {
  const page = await open(PAGE);
  const tried = await page.evaluate(() => {
    const jobs = window.legopt.jobs(0), held = new Set(window.legopt.page.chunks.flat().map(([, job]) => job));
    return ['foot_pose', 'com', 'self_collision', 'environment_collision'].map((verdict) => [verdict, jobs.find(({ job, literal }) => literal === verdict && held.has(job))?.job]).filter(([, job]) => job);
  });
  assert.ok(tried.length > 0, 'no failed job has a solution');
  for (const [verdict, job] of tried) {
    await page.evaluate((id) => { location.hash = `#v=job&job=${id}`; }, job);
    await page.locator('.findings').waitFor();
    await page.waitForFunction((id) => window.legopt.looksAt === id && window.legopt.view?.filled() > 0.01, job);
    const target = await page.evaluate(() => window.legopt.view.cameraState().slice(3));
    if (verdict === 'foot_pose') {
      const link = (await page.locator('.findings li.bad').filter({ hasText: ' off in ' }).first().textContent()).split(':')[0];
      const at = await page.evaluate((name) => { const { view, page: { datasets } } = window.legopt; return view.tree.poses[datasets[0].robot.links.findIndex((l) => l.name === name)].elements.slice(12, 15); }, link);
      assert.ok(Math.hypot(...target.map((v, i) => v - at[i])) < 0.5, `${link} at ${at}, looked at ${target}`);
    } else if (verdict.endsWith('collision')) {
      const before = target;
      await page.locator('.colliding li.bad button').first().click();
      const first = await page.evaluate(() => window.legopt.view.cameraState().slice(3));
      if ((await page.locator('.colliding li.bad').count()) === 1) assert.ok(Math.hypot(...before.map((v, i) => v - first[i])) < 1e-6, verdict);
    }
    assert.match(await page.locator('.facts').textContent(), /outcome, which counts.*solver reported.*does not count/);
  }
  await closeClean(page);
});

test('every view opens without an error, wide and narrow, light and dark, without a scroll bar of its own', async () => {
  for (const [width, colorScheme] of [[1280, 'light'], [390, 'light'], [1280, 'dark'], [390, 'dark']]) {
    const page = await open(PAGE, '', { page: { viewport: { width, height: 900 }, colorScheme } });
    for (const view of ['table', 'profiles', 'compare', 'map', 'jobs', 'about']) {
      await page.evaluate((v) => { location.hash = `#v=${v}`; }, view);
      await page.waitForTimeout(150);
      assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= innerWidth), `${view} at ${width}`);
    }
    await closeClean(page);
  }
});

test('the keyboard alone reaches a job', async () => {
  const page = await open(PAGE);
  await page.getByRole('link', { name: 'Jobs', exact: true }).focus();
  await page.keyboard.press('Enter');
  await page.locator('a.job').first().waitFor();
  for (let i = 0; i < 60 && !(await page.evaluate(() => document.activeElement?.matches('a.job'))); ++i) await page.keyboard.press('Tab');
  assert.ok(await page.evaluate(() => document.activeElement.matches('a.job')));
  await page.keyboard.press('Enter');
  await page.locator('.job-view').waitFor();
  await closeClean(page);
});

test('without WebGL it says so, and the findings are there', async () => {
  const page = await open(PAGE, '', { script: 'HTMLCanvasElement.prototype.getContext = ((get) => function (kind, ...rest) { return /webgl/.test(kind) ? null : get.call(this, kind, ...rest); })(HTMLCanvasElement.prototype.getContext);' });
  await page.getByRole('link', { name: /self collision/ }).first().click();
  await page.locator('.jobs a.job').first().click();
  await page.getByRole('alert').waitFor();
  assert.match(await page.getByRole('alert').textContent(), /no WebGL/);
  assert.ok((await page.locator('.colliding li').count()) > 0);
  assert.deepEqual(page.requests, []);
  await page.close();
});

test('a figure is saved as an SVG that stands alone, and as CSV', async () => {
  const page = await open(PAGE, '#v=profiles');
  await page.locator('.drawing svg').first().waitFor();
  const save = async (name) => {
    const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name, exact: true }).first().click()]);
    return readFileSync(await download.path(), 'utf8');
  };
  const svg = await save('SVG');
  assert.match(svg, /xmlns="http:\/\/www.w3.org\/2000\/svg"/);
  assert.doesNotMatch(svg, /currentColor/);
  assert.equal(await page.evaluate((text) => new DOMParser().parseFromString(text, 'image/svg+xml').querySelector('parsererror'), svg), null);
  assert.match(await save('CSV'), /^method,ratio,share\r\n/);
  await closeClean(page);
});

test('hiding a method changes no other curve', async () => {
  const page = await open(PAGE, '#v=profiles');
  const path = () => page.locator('.drawing').first().locator('g[stroke="#d55e00"] path').first().getAttribute('d');
  await page.locator('.drawing svg').first().waitFor();
  const before = await path();
  await page.locator('.legend button').first().click();
  await page.waitForFunction(() => !document.querySelector('.drawing g[stroke="#0072b2"]'));
  assert.equal(await path(), before);
  await closeClean(page);
});

test('a page of an older release opens', async () => {
  const page = await open(OLD_PAGE);
  assert.equal(await page.evaluate(() => window.legopt.page.format), 1);
  assert.ok((await page.locator('table.scores').count()) > 0);
  await closeClean(page);
});

const LONGEST_MS = 50;

/** The longest time in ms for which the page did not react while `action` ran. */
const blocked = (page, action) => page.evaluate(async (source) => {
  let worst = 0;
  const observer = new PerformanceObserver((list) => { for (const entry of list.getEntries()) worst = Math.max(worst, entry.duration); });
  observer.observe({ type: 'longtask' });
  await eval(source)((ms) => new Promise((done) => setTimeout(done, ms)));
  observer.disconnect();
  return worst;
}, String(action));

const scroll = async (wait) => {
  const rows = document.querySelector('.rows');
  for (let i = 0; i < 20; ++i) {
    rows.scrollTop = (i * 7919 % 20) / 20 * rows.scrollHeight;
    await wait(50);
  }
};
const ACTIONS = {
  'scrolling jobs': ['#v=jobs', scroll],
  'scrolling problems': ['#v=map', scroll],
  'sorting': ['#v=jobs', async (wait) => { for (const i of [5, 4, 0]) { document.querySelectorAll('.jobs thead button')[i].click(); await wait(1000); } }],
  'finding': ['#v=jobs', async (wait) => { for (const text of ['1', '12', '123']) { location.hash = `#v=jobs&q=${text}`; await wait(700); } }],
  'showing curves': ['#v=table', async (wait) => { for (const c of [0, 1]) { location.hash = `#v=profiles&c=${c}`; await wait(2000); } }],
  'comparing': ['#v=table', async (wait) => { for (const b of [1, 2]) { location.hash = `#v=compare&b=${b}`; await wait(2000); } }],
};
for (const [what, [address, action]] of Object.entries(ACTIONS)) {
  test(`135,000 jobs: ${what} never blocks for ${LONGEST_MS} ms`, async () => {
    // Other programs on a busy machine can stop the browser. The page itself blocks in every one of five attempts.
    let longest = Infinity;
    for (let attempt = 0; attempt < 5 && longest > LONGEST_MS; ++attempt) {
      const page = await open(LARGE_PAGE, address);
      await page.locator('main table').first().waitFor();
      await page.waitForTimeout(500);
      longest = Math.min(longest, await blocked(page, action));
      await closeClean(page);
    }
    assert.ok(longest <= LONGEST_MS, `${longest} ms`);
  });
}

test('135,000 jobs: they are sorted, found and counted', async () => {
  const page = await open(LARGE_PAGE, '#v=jobs');
  const first = page.locator('.jobs a.job').first(), counted = page.locator('.bar .says');
  await first.waitFor();
  assert.equal(await first.textContent(), '1');
  await page.getByRole('button', { name: 'Job', exact: true }).click();
  await page.waitForFunction(() => document.querySelector('.jobs th').getAttribute('aria-sort') === 'ascending');
  await page.getByRole('button', { name: /^Job/ }).click();
  await page.waitForFunction(() => document.querySelector('.jobs a.job').textContent === '135000');
  await page.locator('input[type=search]').fill('13499');
  await page.waitForFunction(() => /^(11|12|13) of 135000/.test(document.querySelector('.bar .says').textContent));
  assert.equal(await first.textContent(), '134999');
  assert.equal(await page.locator('.jobs a.job').count(), Number.parseInt(await counted.textContent(), 10));
  await closeClean(page);
});

test('a browser without threads shows the same', async () => {
  const page = await open(PAGE, '#v=jobs', { script: 'delete window.Worker' });
  await page.locator('.jobs a.job').first().waitFor();
  const texts = async (where) => { await where.locator('.jobs a.job').first().waitFor(); return where.locator('.jobs tbody').textContent(); };
  const other = await open(PAGE, '#v=jobs');
  assert.equal(await texts(page), await texts(other));
  await closeClean(page);
  await closeClean(other);
});

test('a view that fails says why, and another one works', async () => {
  const page = await open(PAGE, '#v=profiles', { script: `
    const { postMessage } = Worker.prototype;
    Worker.prototype.postMessage = function (message) { postMessage.call(this, message[1] === 'column' ? [message[0], 'none', []] : message); };` });
  assert.match(await page.locator('main .note').textContent(), /^This view cannot be shown: ./);
  await page.evaluate(() => { location.hash = '#v=jobs&sort=unknown'; });
  await page.locator('.jobs a.job').first().waitFor();
  assert.equal(await page.locator('main > .note').count(), 0);
  await closeClean(page);
});
