// The README's pictures: node pictures.mjs FOLDER, with PAGE, VIEW (of a motion) and BROWSER; see scripts/check-page.
import { chromium } from 'playwright-core';

const { PAGE, VIEW, BROWSER } = process.env, folder = process.argv[2];
const browser = await chromium.launch({ executablePath: BROWSER, args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'] });

async function picture(file, address, name, height, prepare) {
  const page = await browser.newPage({ viewport: { width: 1200, height }, colorScheme: 'light' });
  await page.goto(`file://${file}${address}`);
  await page.waitForFunction(() => window.legopt?.page);
  await prepare(page);
  await page.waitForTimeout(500);
  await page.screenshot({ path: `${folder}/${name}.png` });
  await page.close();
}

await picture(PAGE, '', 'report', 640, async () => undefined);
await picture(VIEW, '#rule=solid', 'motion', 700, async (page) => {
  await page.waitForFunction(() => window.legopt.view?.filled() > 0.05, null, { timeout: 60000 });
  await page.getByRole('button', { name: /next of \d+ violation/ }).click();
  await page.getByRole('button', { name: 'whole robot' }).click();
  await page.evaluate(() => scrollTo(0, 0));
});
await browser.close();
