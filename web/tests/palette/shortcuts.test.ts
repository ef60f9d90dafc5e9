import { expect, test } from 'vitest'
import { actionOf, type Entry, matchingEntries, SHORTCUTS } from '../../src/palette/shortcuts'

const press = (key: string, more = {}) => ({
  ...{ key, ctrlKey: false, metaKey: false, altKey: false, isComposing: false },
  ...more,
})
const inside = (inField: boolean) => ({ closest: () => (inField ? {} : null) }) as never

test('single keys act outside of fields, and only while enabled', () => {
  expect(actionOf(press('n'), inside(false), true)).toEqual({ kind: 'go', href: '/jobs/new' })
  expect(actionOf(press('n'), inside(true), true)).toBeNull()
  expect(actionOf(press('n'), inside(false), false)).toBeNull()
  expect(actionOf(press('n', { altKey: true }), inside(false), true)).toBeNull()
  expect(actionOf(press('n', { ctrlKey: true }), inside(false), true)).toBeNull()
})

test('Ctrl or Cmd with K opens the palette, in fields too and while single keys are disabled', () => {
  for (const held of [{ ctrlKey: true }, { metaKey: true }]) {
    expect(actionOf(press('k', held), inside(true), false)).toEqual({ kind: 'palette' })
  }
})

test('no key has two meanings', () => {
  expect(new Set(SHORTCUTS.map(({ key }) => key)).size).toBe(SHORTCUTS.length)
})

test('entries that start with the text come first', () => {
  const entry = (label: string): Entry => ({ key: label, label, kind: 'page', run: () => {} })
  const entries = [entry('New job'), entry('Jobs'), entry('Walk')]
  expect(matchingEntries(entries, 'job').map(({ label }) => label)).toEqual(['Jobs', 'New job'])
  expect(matchingEntries(entries, '')).toHaveLength(3)
})
