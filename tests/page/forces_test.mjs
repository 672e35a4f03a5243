// Forces and torques on the page: node --test forces_test.mjs, with FORCES_PAGE (a report of postures with hands, some
// beyond the effort limits), TRAPS_PAGE (of stances that nothing holds), VIEW (of a motion on feet) and BROWSER.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import { chromium } from 'playwright-core';

const PATIENCE_MS = 180000; // the processor renders pictures, and other tests may keep it busy

const { FORCES_PAGE, TRAPS_PAGE, VIEW, BROWSER } = process.env;
const FLAGS = ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
let browser;
before(async () => { browser = await chromium.launch({ executablePath: BROWSER, args: FLAGS }); });
after(() => browser?.close());

async function open(file) {
  const page = await browser.newPage({ viewport: { width: 1280, height: 900 } });
  page.setDefaultTimeout(PATIENCE_MS);
  page.faults = [];
  page.on('console', (message) => { if (['error', 'warning'].includes(message.type()) && !/GPU stall|GL Driver/.test(message.text())) page.faults.push(message.text()); });
  page.on('pageerror', (error) => page.faults.push(String(error)));
  await page.goto(`file://${file}`);
  await page.waitForFunction(() => window.legopt?.page);
  return page;
}

async function closeClean(page) {
  assert.deepEqual(page.faults, []);
  await page.close();
}

/** Opens a job with this verdict, by the links that a reader follows. */
async function follow(page, verdict) {
  await page.getByRole('link', { name: new RegExp(verdict) }).first().click();
  await page.locator('.jobs tbody tr', { hasText: `\u2715 ${verdict}` }).locator('a.job').first().click();
  await page.waitForFunction(() => window.legopt.looksAt !== undefined && window.legopt.view?.filled() > 0.01);
}

const drawn = (page) => page.evaluate(() => window.legopt.view.drawnForces());
const target = (page) => page.evaluate(() => window.legopt.view.cameraState().slice(3));
const distance = (a, b) => Math.hypot(...a.map((v, i) => v - b[i]));

test('a posture with hands shows its forces, cones, torques and polygon, and a toggle hides them', async () => {
  const page = await open(FORCES_PAGE);
  const job = await page.evaluate(() => window.legopt.jobs(0).find(({ physical }) => physical === 'success')?.job);
  await page.evaluate((id) => { location.hash = `#v=job&job=${id}`; }, job);
  await page.waitForFunction(() => window.legopt.view?.drawnForces().length > 0);
  const names = await drawn(page);
  for (const kind of [/^force l_foot \d+: \d+ N$/, /^force [lr]_(palm|grip) \d+: \d+ N$/, /^friction cone /, /^equilibrium polygon$/, / % of the limit$/]) {
    assert.ok(names.some((name) => kind.test(name)), `${kind} of ${names}`);
  }
  assert.match(await page.locator('.force-legend').textContent(), /\d+ N.*torque, 0 to its limit/);
  // Up to friction and slopes, the drawn forces carry the weight.
  const weight = await page.evaluate(() => window.legopt.page.datasets[0].robot.weight_N);
  const sum = names.reduce((total, name) => total + Number(/^force .*: (\d+) N$/.exec(name)?.[1] ?? 0), 0);
  assert.ok(sum > 0.99 * weight, `${sum} N of ${weight} N`);
  const rows = await page.locator('.loads tbody tr').count();
  assert.ok(rows >= 3, `${rows} contacts`);
  assert.match(await page.locator('.torques li').first().textContent(), /of .* N m, \d+ %/);
  const colours = () => page.evaluate(() => window.legopt.view.filled());
  const shown = await colours();
  await page.getByLabel('forces', { exact: true }).uncheck();
  await page.waitForFunction(() => window.legopt.view.drawnForces().length === 0);
  assert.notEqual(await colours(), shown);
  assert.equal(await page.locator('.force-legend').count(), 0);
  await page.getByLabel('forces', { exact: true }).check();
  await page.waitForFunction(() => window.legopt.view.drawnForces().length > 0);
  await closeClean(page);
});

test('a failed cell leads to the overloaded joint', async () => {
  const page = await open(FORCES_PAGE);
  await follow(page, 'torque');
  const detail = await page.locator('.facts').textContent();
  const joint = /rule, (\S+) needs at least/.exec(detail)[1];
  const entry = page.locator('.torques li.overloaded', { hasText: joint });
  assert.match(await entry.textContent(), /overloaded.*1\d\d %/);
  assert.ok((await drawn(page)).includes(`${joint} is overloaded`));
  const at = await page.evaluate((name) => { const { view, page: { datasets } } = window.legopt; return view.tree.poses[datasets[0].robot.joints.find((j) => j.name === name).child].elements.slice(12, 15); }, joint);
  assert.ok(distance(await target(page), at) < 1e-3, 'the view turns about the joint');
  await closeClean(page);
});

test('a failed cell leads to the contact that slips, with its direction', async () => {
  const page = await open(TRAPS_PAGE);
  await follow(page, 'equilibrium');
  const text = await page.locator('.collapse li.failing').textContent();
  const contact = /^(\S+) slips along \(-?\d\.\d\d, -?\d\.\d\d, -?\d\.\d\d\)$/.exec(text)?.[1];
  assert.ok(contact, text);
  const names = await drawn(page);
  assert.ok(names.includes(`${contact} slips`) && names.includes('fall of the centre of mass'), `${names}`);
  assert.ok(!names.some((name) => name.startsWith('force ')), 'no forces hold it');
  const before = await target(page);
  await page.locator('.collapse li.failing button').click();
  assert.ok(distance(before, await target(page)) < 1e-3, 'the view opened at the contact');
  await closeClean(page);
});

/** The nodes' names and the animations of the saved glTF. */
async function savedScene(page) {
  const [download] = await Promise.all([page.waitForEvent('download'), page.getByRole('button', { name: 'glTF' }).click()]);
  const bytes = readFileSync(await download.path());
  return JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString('utf8'));
}

test('glTF has the forces of each waypoint, shown at its time', async () => {
  const posture = await open(FORCES_PAGE);
  await follow(posture, 'torque');
  const single = (await savedScene(posture)).nodes.map(({ name }) => name ?? '');
  for (const kind of [/^forces$/, /^force_/, /^friction_cone_/, /of_the_limit$/, /is_overloaded$/]) assert.ok(single.some((name) => kind.test(name.replace(/\s/g, '_'))), `${kind} of ${single}`);
  await closeClean(posture);
  const motion = await open(VIEW);
  await motion.waitForFunction(() => window.legopt.view?.filled() > 0.05);
  assert.deepEqual(await drawn(motion), [], 'a motion on feet opens without them');
  await motion.getByLabel('forces', { exact: true }).check();
  await motion.waitForFunction(() => window.legopt.view.drawnForces().some((name) => name.startsWith('force ')));
  const { nodes, animations } = await savedScene(motion);
  const waypoints = await motion.evaluate(() => Number(document.querySelector('input[type=range]').max) + 1);
  assert.equal(nodes.filter(({ name }) => /^forces.at.waypoint/.test(name ?? '')).length, waypoints);
  assert.ok(animations[0].samplers.filter(({ interpolation }) => interpolation === 'STEP').length >= waypoints);
  await closeClean(motion);
});
