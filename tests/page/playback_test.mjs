// Motions in time on the page: node --test playback_test.mjs, with EXECUTABLE_VIEW and BLOCKED_VIEW (views of motions
// that can and cannot be executed), SERVED (the address of legopt serve, whose job 1 is the first of them) and BROWSER.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { chromium } from 'playwright-core';

const PATIENCE_MS = 180000; // the processor renders pictures, and other tests may keep it busy

const { EXECUTABLE_VIEW, BLOCKED_VIEW, SERVED, BROWSER } = process.env;
const FLAGS = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
let browser;
before(async () => { browser = await chromium.launch({ executablePath: BROWSER, args: FLAGS }); });
after(() => browser?.close());

async function open(address) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 1000 } });
  page.setDefaultTimeout(PATIENCE_MS);
  page.faults = [];
  page.on('console', (message) => { if (['error', 'warning'].includes(message.type()) && !/GPU stall|GL Driver/.test(message.text())) page.faults.push(message.text()); });
  page.on('pageerror', (error) => page.faults.push(String(error)));
  await page.goto(address);
  await page.waitForFunction(() => window.legopt?.view?.filled() > 0.01);
  return page;
}

async function closeClean(page) {
  assert.deepEqual(page.faults, []);
  await page.close();
}

/** Time and duration that the clock shows, s. */
async function clock(page) {
  const [, time, duration] = /^(\d+\.\d\d) of (\d+\.\d\d) s$/.exec(await page.locator('.clock').textContent());
  return { time: Number(time), duration: Number(duration) };
}

/** Moves the slider to a share of the duration. */
async function moveTo(page, share) {
  await page.getByLabel('time', { exact: true }).evaluate((slider, value) => {
    slider.value = String(value * Number(slider.max));
    slider.dispatchEvent(new Event('input', { bubbles: true }));
  }, share);
  await page.waitForFunction((value) => {
    const [time, duration] = document.querySelector('.clock').textContent.split(' of ').map(parseFloat);
    return Math.abs(time - value * duration) < 0.011;
  }, share);
}

const bars = (page, kind) => page.locator(`.joint-loads td.${kind} .load`).evaluateAll((all) => all.map((bar) => bar.getAttribute('aria-label')));
const cursor = (page) => page.locator('.share-curves line.cursor').evaluate((line) => Number(line.getAttribute('x1')));

test('a motion that can be executed plays in seconds, and pauses', async () => {
  const page = await open(`file://${EXECUTABLE_VIEW}`);
  await page.locator('.clock').waitFor();
  assert.equal((await clock(page)).time, 0);
  await page.getByRole('combobox', { name: 'speed' }).selectOption('0.25');
  await page.getByRole('button', { name: 'play' }).click();
  const seen = () => page.evaluate(() => [performance.now() / 1000, parseFloat(document.querySelector('.clock').textContent)]);
  await page.waitForFunction(() => parseFloat(document.querySelector('.clock').textContent) > 0.1);
  const [begin, from] = await seen();
  await page.waitForFunction((time) => parseFloat(document.querySelector('.clock').textContent) > time + 0.6, from);
  const [end, to] = await seen();
  const speed = (to - from) / (end - begin);
  assert.ok(speed > 0.1 && speed < 0.4, `${speed} s of the motion per second, chosen: 0.25`);
  await page.getByRole('button', { name: 'pause' }).click();
  const { time, duration } = await clock(page);
  assert.ok(time >= to - 0.01 && time <= duration);
  await closeClean(page);
});

test('joints have bars of velocity and torque against their limits, which change with the time', async () => {
  const page = await open(`file://${EXECUTABLE_VIEW}`);
  await page.locator('.joint-loads').waitFor();
  const { robot } = await page.evaluate(() => window.legopt.page.datasets[0]);
  const velocities = await bars(page, 'velocity'), torques = await bars(page, 'torque');
  assert.equal(velocities.length, robot.dofs.length);
  for (const text of velocities) assert.match(text, /^0 of 16(\.0)? rad\/s, 0 %$/, 'the motion begins at rest');
  for (const text of torques) assert.match(text, /^\S+ of 60(\.0)? N m, \d+ %$/);
  await moveTo(page, 0.3);
  assert.ok((await bars(page, 'velocity')).some((text) => !text.startsWith('0 of')));
  assert.notDeepEqual(await bars(page, 'torque'), torques);
  await moveTo(page, 1);
  assert.ok((await bars(page, 'velocity')).every((text) => text.startsWith('0 of')), 'the motion ends at rest');
  await closeClean(page);
});

test('contact forces of the time are drawn and listed, and stay in their friction cones', async () => {
  const page = await open(`file://${EXECUTABLE_VIEW}`);
  await page.locator('.clock').waitFor();
  const drawn = () => page.evaluate(() => window.legopt.view.drawnForces().filter((name) => name.startsWith('force ')));
  await page.waitForFunction(() => window.legopt.view.drawnForces().some((name) => name.startsWith('force ')));
  const before = await drawn();
  await moveTo(page, 0.4);
  await page.waitForFunction((names) => JSON.stringify(window.legopt.view.drawnForces().filter((name) => name.startsWith('force '))) !== JSON.stringify(names), before);
  const shares = await page.locator('.loads').first().locator('tbody td:last-child').allTextContents();
  assert.ok(shares.length >= 2, `${shares}`);
  for (const share of shares.filter((text) => text !== '\u2013')) assert.ok(parseInt(share, 10) <= 100, share);
  await closeClean(page);
});

test('the curves have a cursor at the time, and are saved as CSV', async () => {
  const page = await open(`file://${EXECUTABLE_VIEW}`);
  await page.locator('.share-curves svg').first().waitFor();
  const start = await cursor(page), { duration } = await clock(page);
  await moveTo(page, 0.5);
  const middle = await cursor(page);
  await moveTo(page, 1);
  const end = await cursor(page);
  assert.ok(Math.abs(middle - (start + end) / 2) < 4 && end > start + 100, `${start} ${middle} ${end}`);
  assert.match(await page.locator('.share-curves figcaption').textContent(), /Nearest limit: (contact|torque|velocity) \d+ % of the time/);
  const [download] = await Promise.all([page.waitForEvent('download'), page.locator('.share-curves').getByRole('button', { name: 'CSV' }).click()]);
  const rows = readFileSync(await download.path(), 'utf8').trim().split(/\r?\n/).map((line) => line.split(','));
  assert.deepEqual(rows[0], ['time_s', 'velocity_share', 'torque_share']);
  assert.ok(Math.abs(Number(rows.at(-1)[0]) - duration) < 0.01);
  for (const [, velocity, torque] of rows.slice(1)) assert.ok(Number(velocity) <= 1.05 && Number(torque) <= 1.05, `${velocity} ${torque}`);
  await closeClean(page);
});

test('the slider has waypoints if the user chooses', async () => {
  const page = await open(`file://${EXECUTABLE_VIEW}`);
  await page.locator('.clock').waitFor();
  await page.getByLabel('in time').uncheck();
  await page.getByRole('slider', { name: 'waypoint' }).waitFor();
  assert.equal(await page.locator('.clock').count(), 0);
  assert.equal(await page.locator('.share-curves').count(), 0);
  await page.getByLabel('in time').check();
  await page.locator('.clock').waitFor();
  await closeClean(page);
});

test('a motion that cannot be executed says where and why, and plays by waypoint', async () => {
  const page = await open(`file://${BLOCKED_VIEW}`);
  const note = page.locator('.note.blocked');
  assert.match(await note.textContent(), /cannot be executed in time: it is blocked at waypoint \d+\.\d\d: (friction|torque|velocity) of \S+\./);
  await note.getByRole('button').click();
  assert.match(await page.locator('.player output').textContent(), /^waypoint \d+(\.\d+)? of \d+$/);
  await page.getByRole('button', { name: 'play' }).click();
  const start = await page.getByRole('slider', { name: 'waypoint' }).inputValue();
  await page.waitForFunction((from) => document.querySelector('input[type=range]').value !== from, start);
  assert.equal(await page.getByLabel('in time').count(), 0);
  await closeClean(page);
});

test('a server computes the time law when a user opens the motion', async () => {
  const page = await open(`${SERVED.trim()}#v=job&job=1`);
  await page.locator('.clock').waitFor();
  const served = await clock(page);
  const view = await open(`file://${EXECUTABLE_VIEW}`);
  await view.locator('.clock').waitFor();
  assert.deepEqual(served, await clock(view));
  await closeClean(view);
  await closeClean(page);
});
