// The page's main path in Firefox: main-path.mjs FIREFOX URL JOB FOLDER
//
// Lists jobs, submits one, follows its progress, opens the replay of one of its designs, and compares it
// with JOB. Screenshots are saved to FOLDER. Prints problems and exits with 1 if there are any.
import { join } from 'node:path'
import { withPage } from './bidi.mjs'

const [executable, url, other, folder] = process.argv.slice(2)
const WIDTHS = [360, 1280]
const OTHER_SCENARIOS = [
  '2 normal-slow',
  '3 loaded-fast',
  '4 loaded-slow',
  '5 slope-fast',
  '6 turn',
]

async function checkWidths(page, name) {
  for (const width of WIDTHS) {
    await page.resize(width, 800)
    const wide = await page.evaluate(async () => {
      // Wait for the layout, including charts.
      await new Promise((resolve) => setTimeout(resolve, 300))
      const { scrollWidth, clientWidth } = document.documentElement
      return scrollWidth > clientWidth
    })
    if (wide) page.problems.push(`${name} is wider than ${width} px`)
    await page.picture(join(folder, `${name}-${width}.png`))
  }
}

async function mainPath(page) {
  await page.resize(1280, 800)
  await page.go(`${url}/jobs`)
  await page.until(
    'the list',
    (job) => document.querySelector(`[data-job='${job}']`) !== null,
    other,
  )
  await checkWidths(page, 'jobs')

  await page.click('main a', 'New job')
  await page.until('the form', () => document.querySelector('[data-walks]') !== null)
  await checkWidths(page, 'form')
  await page.fill('Name', 'in Firefox')
  await page.click('summary', 'Advanced')
  await page.fill('Iterations', '12')
  await page.fill('Particles', '8')
  for (const scenario of OTHER_SCENARIOS) await page.click('label', scenario)
  await page.until('96 walks', () => document.querySelector('[data-walks="96"]') !== null)
  await page.click('button', 'Submit the job')

  await page.until('progress', () => {
    return Number(document.querySelector('[data-stream]')?.dataset.iteration) >= 2
  })
  await page.until('its end', () => /succeeded/.test(document.querySelector('main').textContent))
  await page.until('the curves', () => document.querySelector('main canvas, main svg') !== null)
  const job = await page.evaluate(() => location.pathname.split('/')[2])
  await checkWidths(page, 'job')

  await page.click('nav a', 'Details')
  await page.click('nav a', 'Iterations')
  await page.click('main tbody a')
  await page.click('main tbody a[href*="/walk"]')
  await page.until('the walk', () => document.querySelector('[data-player][data-frame]') !== null)
  await checkWidths(page, 'walk')

  await page.go(`${url}/compare?jobs=${job},${other}`)
  await page.until('both', () => document.querySelectorAll('[data-compared]').length === 2)
  await checkWidths(page, 'compare')
}

// Reduced motion and light colours.
const preferences = {
  'ui.prefersReducedMotion': 1,
  'layout.css.prefers-color-scheme.content-override': 1,
}
await withPage(executable, preferences, async (page) => {
  await mainPath(page).catch((error) => page.problems.push(String(error)))
  for (const line of page.problems) console.error(line)
  process.exitCode = page.problems.length ? 1 : 0
})
