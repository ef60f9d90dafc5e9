import { expect, test } from 'vitest'
import text from '../../../docs/glossary.md?raw'
import { GLOSSARY } from '../../src/components/term'

test('the page defines terms as the glossary of the manual does', () => {
  const definitions = new Map(
    [...text.matchAll(/^(.+)\n: ((?:.+\n?)+)/gm)].map(([, name, words]) => [
      name,
      words.replace(/\s+/g, ' ').replaceAll('`', '').trim(),
    ]),
  )
  for (const [name, words] of Object.entries(GLOSSARY)) expect(definitions.get(name)).toBe(words)
})
