import { expect, test } from 'vitest'
import { type Entry, found } from '../../src/palette/entries'
import { actionOf, SHORTCUTS } from '../../src/palette/shortcuts'

const press = (key: string, more = {}) => ({
  ...{ key, ctrlKey: false, metaKey: false, altKey: false, isComposing: false },
  ...more,
})
const inside = (inField: boolean) => ({ closest: () => (inField ? {} : null) }) as never

test('keys act outside of fields, and only while they are switched on', () => {
  expect(actionOf(press('n'), inside(false), true)).toEqual({ kind: 'go', href: '/jobs/new' })
  expect(actionOf(press('n'), inside(true), true)).toBeNull()
  expect(actionOf(press('n'), inside(false), false)).toBeNull()
  expect(actionOf(press('n', { altKey: true }), inside(false), true)).toBeNull()
  expect(actionOf(press('n', { ctrlKey: true }), inside(false), true)).toBeNull()
})

test('Ctrl or Cmd with K finds, in fields and while single keys are off too', () => {
  for (const held of [{ ctrlKey: true }, { metaKey: true }]) {
    expect(actionOf(press('k', held), inside(true), false)).toEqual({ kind: 'palette' })
  }
})

test('no key has two meanings', () => {
  expect(new Set(SHORTCUTS.map(({ key }) => key)).size).toBe(SHORTCUTS.length)
})

test('what begins with the words that are looked for comes first', () => {
  const entry = (label: string): Entry => ({ key: label, label, kind: 'page', run: () => {} })
  const entries = [entry('New job'), entry('Jobs'), entry('Walk')]
  expect(found(entries, 'job').map(({ label }) => label)).toEqual(['Jobs', 'New job'])
  expect(found(entries, '')).toHaveLength(3)
})
