import { describe, expect, test } from 'vitest'
import { widened } from '../../../src/submission/draft/bounds'
import { emptyDraft } from '../../../src/submission/draft/draft'
import { CATALOGUE } from '../catalogue-example'

const empty = emptyDraft(CATALOGUE)

describe('other bounds', () => {
  test('replace those of searched variables only', () => {
    const fixed = { ...empty.variables.FOMF, mode: 'fixed' as const }
    const draft = { ...empty, variables: { ...empty.variables, FOMF: fixed } }
    const wider = widened(draft, 'P:-1:2.5,FOMF:0:9,unknown:0:1')
    expect(wider.variables.P).toMatchObject({ low: '-1', high: '2.5' })
    expect(wider.variables.FOMF).toEqual(fixed)
    expect(wider.variables.unknown).toBeUndefined()
  })

  test('are ignored if invalid', () => {
    for (const bounds of ['', 'P', 'P:1', 'P:a:b', 'P::2', 'P:1:2:3']) {
      expect(widened(empty, bounds)).toEqual(empty)
    }
  })
})
