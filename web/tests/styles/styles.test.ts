import { expect, test } from 'vitest'
import { type Sources, sheetsOfModules, sourcesOf } from './chunks'
import { classesIn, classesOf, selectorsOf } from './classes'

const ROOT = '../../src/'
const texts = import.meta.glob<string>('../../src/**/*.{ts,tsx,css}', {
  query: '?raw',
  import: 'default',
  eager: true,
})

/** All uses of classes, and all rules. */
function survey(sources: Sources) {
  const available = sheetsOfModules(sources, 'main.tsx')
  const modules = [...sources.values()].filter(({ path }) => path.endsWith('.tsx'))
  const used = modules.flatMap(({ path, text }) =>
    [...classesOf(path, text)].map((name) => ({ name, path, sheets: available.get(path)! })),
  )
  const rules = [...sources.values()]
    .filter(({ path }) => path.endsWith('.css'))
    .flatMap(({ path, text }) =>
      selectorsOf(text).map((selector) => ({ sheet: path, selector, names: classesIn(selector) })),
    )
  return { used, rules, everywhere: available.get('main.tsx')! }
}

type Survey = ReturnType<typeof survey>

function isNamed(use: string, name: string): boolean {
  return use === name || new RegExp(`^${use.replaceAll('*', String.raw`\d+`)}$`).test(name)
}

/** Classes of components whose styles may not be loaded with the component. */
function unstyled({ used, rules }: Survey): readonly string[] {
  return used
    .filter(
      ({ name, sheets }) =>
        !rules.some((rule) => sheets.has(rule.sheet) && rule.names.some((n) => isNamed(name, n))),
    )
    .map(({ name, path }) => `${name} in ${path}`)
}

/** Rules of a page that also match components shown without that page. */
function leaking({ used, rules, everywhere }: Survey): readonly string[] {
  const isElsewhere = (sheet: string, name: string) =>
    used.some((use) => isNamed(use.name, name) && !use.sheets.has(sheet))
  return rules
    .filter(({ sheet, selector }) => !everywhere.has(sheet) && !selector.startsWith('#'))
    .filter(({ sheet, names }) => names.every((name) => isElsewhere(sheet, name)))
    .map(({ sheet, selector }) => `${selector} in ${sheet}`)
}

/** Rules for unused classes. */
function unused({ used, rules }: Survey): readonly string[] {
  const isUsed = (name: string) => used.some((use) => isNamed(use.name, name))
  return rules
    .filter(({ names }) => !names.every(isUsed))
    .map(({ sheet, selector }) => `${selector} in ${sheet}`)
}

const page = survey(
  sourcesOf(
    Object.fromEntries(Object.entries(texts).map(([k, text]) => [k.slice(ROOT.length), text])),
  ),
)

test('the styles of each class are loaded with its component', () => {
  expect(unstyled(page)).toEqual([])
})

test('a visited page does not restyle other pages', () => {
  expect(leaking(page)).toEqual([])
})

test('every rule is for a class in use', () => {
  expect(unused(page)).toEqual([])
})

test('a stylesheet of another chunk and a leaking rule are detected', () => {
  const example = survey(
    sourcesOf({
      'main.tsx': "import './base.css'; import('./job/page'); import('./walk/page')",
      'base.css': '.card { margin: 0 }',
      'job/page.tsx': "import './job.css'; import '../shared'; import('./panel')",
      'job/job.css': '.card .bar, .bar:is(.a, .b) { margin: 0 } .gone { margin: 0 }',
      'job/panel.tsx': 'const a = <i class="card bar" />',
      'walk/page.tsx':
        "import './walk.css'; import '../shared'; const a = <i class={x ? 'a' : 'b'} />",
      'walk/walk.css': '@media print { .card, .walk-1 { margin: 0 } } summary { margin: 0 }',
      'shared.tsx': 'const a = <i class={`bar walk-$' + '{k}`} />',
    }),
  )
  expect(unstyled(example)).toEqual([
    'a in walk/page.tsx',
    'b in walk/page.tsx',
    'bar in shared.tsx',
    'walk-* in shared.tsx',
  ])
  expect(leaking(example)).toEqual([
    '.bar:is(.a, .b) in job/job.css',
    '.card in walk/walk.css',
    '.walk-1 in walk/walk.css',
    'summary in walk/walk.css',
  ])
  expect(unused(example)).toEqual(['.gone in job/job.css'])
})
