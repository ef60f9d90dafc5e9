import { describe, expect, test } from 'vitest'
import { around } from '../../../src/submission/draft/bounds'
import { specOf } from '../../../src/submission/draft/build-spec'
import { draftOf } from '../../../src/submission/draft/draft'
import { optimizerDraft, settingsOf, withPreset } from '../../../src/submission/draft/settings'
import { boundsInWords } from '../../../src/submission/fields/schema-fields'
import { CATALOGUE } from '../catalogue-example'
import { EMPTY } from './drafts'

describe('the optimizer', () => {
  const { optimizers } = CATALOGUE
  const [pso, falling, simplex] = optimizers

  test('is the default method with its settings', () => {
    expect(EMPTY.optimizer).toEqual({ name: 'pso', particles: '25', inertia_end: '0.9' })
    expect(specOf(EMPTY).optimizer).toEqual(pso.settings)
  })

  test('keeps the size of its iterations with a preset or another method', () => {
    const large = { name: 'pso', particles: '40', inertia_end: '0.9' }
    expect(withPreset(large, falling)).toEqual({ name: 'pso', particles: '40', inertia_end: '0.7' })
    expect(withPreset(large, simplex)).toMatchObject({ name: 'simplex', particles: '40' })
    expect(withPreset(large, simplex)).not.toHaveProperty('inertia_end')
  })

  test("offers the settings of the method's schema, except its name", () => {
    const fields = new Map(settingsOf(simplex).map((field) => [field.name, field]))
    expect([...fields.keys()]).toEqual(['particles', 'restarts', 'steps', 'order'])
    expect(fields.get('restarts')).toMatchObject({
      type: 'boolean',
      description: 'Whether it restarts.',
    })
    expect(fields.get('order')?.choices).toEqual(['1', '2'])
    expect(boundsInWords(fields.get('particles')!)).toBe('1 to 10\u202f000')
  })

  test('becomes numbers, booleans and lists; empty settings are omitted', () => {
    const { optimizer } = draftOf({ ...specOf(EMPTY), optimizer: 'simplex' } as never, CATALOGUE)
    expect(specOf({ ...EMPTY, optimizer }).optimizer).toEqual({
      name: 'simplex',
      particles: 25,
      restarts: true,
      steps: [1, 2],
    })
    const wrong = { ...optimizer, restarts: 'false', steps: '[1, ', order: 'two' }
    expect(specOf({ ...EMPTY, optimizer: wrong }).optimizer).toMatchObject({
      restarts: false,
      steps: '[1, ',
      order: 'two',
    })
  })

  test('of a cloned job may be a name, or settings without their defaults', () => {
    const named = draftOf({ ...specOf(EMPTY), optimizer: 'pso-falling-inertia' }, CATALOGUE)
    expect(named.optimizer.inertia_end).toBe('0.7')
    expect(optimizerDraft(optimizers, { name: 'simplex', particles: 3 }, 'pso')).toMatchObject({
      particles: '3',
      restarts: 'true',
    })
    expect(optimizerDraft(optimizers, { particles: 3 }, 'pso')).toMatchObject({
      name: 'pso',
      inertia_end: '0.9',
    })
  })
})

describe('the neighbourhood of a design', () => {
  const near = (design: Record<string, number>) =>
    around(EMPTY, design, new Set(['FOMF'])).variables

  test('is a part of the range around the design', () => {
    expect(near({ P: 0.5 }).P).toMatchObject({ low: '0.35', high: '0.65' })
  })

  test('stays within the bounds and keeps its width', () => {
    expect(near({ P: 1 }).P).toMatchObject({ low: '0.7', high: '1' })
  })

  test('keeps the choices of a categorical variable', () => {
    const window = { ...EMPTY.variables.window, mode: 'searched' as const }
    const draft = { ...EMPTY, variables: { ...EMPTY.variables, window } }
    expect(around(draft, { window: 'hamming' }, new Set()).variables.window).toEqual(window)
  })

  test('of an integer variable has distinct integer bounds', () => {
    expect(near({ FOMF: 2 }).FOMF).toMatchObject({ low: '1', high: '3' })
  })
})
