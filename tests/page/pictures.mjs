// Makes the README's pictures: node pictures.mjs FOLDER, with PAGE, VIEW (of a motion), PATH_VIEW (of a continuous
// one) and BROWSER; see scripts/check-page.
import { chromium } from 'playwright-core';

const PATIENCE_MS = 180000; // the processor renders pictures, and other tests may keep it busy

const { PAGE, VIEW, PATH_VIEW, BROWSER } = process.env, folder = process.argv[2];
const browser = await chromium.launch({ executablePath: BROWSER, args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'] });

async function picture(file, address, name, height, prepare) {
  const page = await browser.newPage({ viewport: { width: 1200, height }, colorScheme: 'light' });
  page.setDefaultTimeout(PATIENCE_MS);
  await page.goto(`file://${file}${address}`);
  await page.waitForFunction(() => window.legopt?.page);
  await prepare(page);
  await page.waitForTimeout(500);
  await page.screenshot({ path: `${folder}/${name}.png` });
  await page.close();
}

await picture(PAGE, '', 'report', 640, async () => undefined);
await picture(VIEW, '#rule=solid', 'motion', 700, async (page) => {
  await page.waitForFunction(() => window.legopt.view?.filled() > 0.05);
  await page.getByRole('button', { name: /next of \d+ violation/ }).click();
  await page.getByRole('button', { name: 'whole robot' }).click();
  await page.evaluate(() => scrollTo(0, 0));
});

// Sixteen places on the path from a waypoint to the sixth after it, two steps, in rows of four.
const FIRST = 8, FRAMES = 16, WAYS = 6;
const frames = [];
await picture(PATH_VIEW, '', 'path', 700, async (page) => {
  await page.waitForFunction(() => window.legopt.view?.filled() > 0.05);
  for (let k = 0; k < FRAMES; ++k) {
    await page.getByLabel('waypoint').evaluate((slider, place) => {
      slider.value = String(place);  // the browser rounds to its step
      slider.dispatchEvent(new Event('input', { bubbles: true }));
    }, FIRST + WAYS * k / (FRAMES - 1));
    if (k === 0) await page.getByRole('button', { name: 'whole robot' }).click();
    await page.waitForTimeout(300);
    frames.push((await page.locator('canvas').screenshot()).toString('base64'));
  }
  await page.setContent(`<style>body { margin: 0; display: grid; grid-template-columns: repeat(4, 1fr) } img { width: 100% }</style>
    ${frames.map((frame) => `<img src="data:image/png;base64,${frame}">`).join('')}`);
  await page.setViewportSize({ width: 1200, height: await page.evaluate(() => document.documentElement.scrollHeight) });
});
await browser.close();
