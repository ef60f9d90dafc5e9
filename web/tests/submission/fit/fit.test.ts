import { describe, expect, test } from 'vitest'
import type { OptimizerPreset, RecordingView, Variable } from '../../../src/api/types'
import { EMPTY_FIT, errorsByPart } from '../../../src/submission/fit/fit'
import { identificationSpec } from '../../../src/submission/fit/identification'
import { parameterDrafts, parameterErrors } from '../../../src/submission/fit/parameters'
import {
  emptyWalk,
  measuredRequest,
  walkErrors,
} from '../../../src/submission/fit/recordings/measured-walk'
import { choiceOf, idsIn } from '../../../src/submission/fit/recordings/recording-search'
import { calibrationSpec, nextKey, withRecordings } from '../../../src/submission/fit/targets'
import { CATALOGUE } from '../catalogue-example'

test('a stored recording is offered with a description', () => {
  const stored = { id: '0f343b0931126a20', created_at: '2026-03-01T10:00:00Z', size: 206113 }
  const walk = { scenario: 'slope', controller: 'pi', joints: 18, seconds: 3 }
  const choice = choiceOf({ ...stored, ...walk, rows: 1500, synthetic: true })
  expect([choice.value, choice.label]).toEqual([stored.id, '3.00 s of slope with pi'])
  expect(choice.note).toContain('0f343b093112 · 2026-03-01')
  expect(choice.note).toContain('18 joints · 206 kB · synthetic')
})

test.each([
  ['one', 'a'.repeat(32), ['a'.repeat(32)]],
  ['as JSON', `["${'a'.repeat(32)}", "${'b'.repeat(32)}"]`, ['a'.repeat(32), 'b'.repeat(32)]],
  ['one twice, by lines', `${'0'.repeat(32)}\n${'0'.repeat(32)}\n`, ['0'.repeat(32)]],
  ['with a word between', `${'a'.repeat(32)} and ${'b'.repeat(32)}`, []],
  ['cut short', 'a'.repeat(12), []],
  ['none', ' ', []],
])('ids of recordings are pasted: %s', (_, text, ids) => expect(idsIn(text)).toEqual(ids))

const METHODS = [
  { settings: { name: 'pso', particles: 25 } },
  { settings: { name: 'one-at-a-time' } },
] as unknown as readonly OptimizerPreset[]

const parameter = (name: string, low: number, high: number) =>
  ({ name, low, high, unit: '1', kind: 'continuous', description: '' }) as unknown as Variable

const FITTABLE = [
  parameter('body_mass', 2, 6),
  parameter('battery_voltage', 8, 13),
  { ...parameter('contact_law', 0, 0), kind: 'categorical', choices: ['stick', 'dead_zone'] },
] as readonly Variable[]

const ALL = { fittable: FITTABLE, fittedByDefault: null, edited: {} }
const drafts = parameterDrafts(ALL)

test('an API error is assigned to its parameter, however many are fitted', () => {
  const parameters = { fittable: FITTABLE, fittedByDefault: ['battery_voltage'], edited: {} }
  const errors = [
    { field: 'variables.0.low', message: 'must be a number' },
    { field: 'variables', message: 'too few' },
  ]
  expect([...parameterErrors(errors, parameters)]).toEqual([
    ['variables.battery_voltage.low', 'must be a number'],
  ])
})

describe('an identification', () => {
  test('has parameters by name, with bounds, or with choices', () => {
    const edited = {
      battery_voltage: { ...drafts.battery_voltage, mode: 'searched', low: '9' } as const,
      contact_law: { ...drafts.contact_law, mode: 'searched', choices: ['stick'] } as const,
    }
    const draft = { ...EMPTY_FIT, name: 'fit', edited: edited }
    const parameters = { fittable: FITTABLE, fittedByDefault: ['body_mass'], edited: edited }
    expect(
      identificationSpec(draft, parameters, '1,3', 'szabadka2', ['aa', 'bb'], METHODS),
    ).toEqual({
      kind: 'identification',
      name: 'fit',
      robot: 'szabadka2',
      recordings: ['aa', 'bb'],
      links: [1, 3],
      variables: [
        'body_mass',
        { name: 'battery_voltage', low: 9, high: 13 },
        { name: 'contact_law', kind: 'categorical', choices: ['stick'] },
      ],
      optimizer: { name: 'pso', particles: 48, inertia_start: 0.9, inertia_end: 0.4 },
      iterations: 120,
      seed: 1,
    })
  })

  test('sends invalid numbers as typed, and no particles to a method without', () => {
    const draft = { ...EMPTY_FIT, method: 'one-at-a-time', iterations: 'ten' }
    const spec = identificationSpec(draft, ALL, 'foot', 'szabadka2', [], METHODS)
    expect(spec.optimizer).toEqual({ name: 'one-at-a-time' })
    expect([spec.iterations, spec.links]).toEqual(['ten', ['foot']])
    expect(spec.variables).toEqual(['body_mass', 'battery_voltage', 'contact_law'])
  })

  test('has the errors of the API by part, with the entry', () => {
    const errors = [
      { field: 'recordings.1', message: 'unknown' },
      { field: 'recordings', message: 'too few' },
      { field: 'targets.0.value', message: 'none' },
    ]
    expect(errorsByPart(errors)).toEqual({
      recordings: 'entry 2: unknown; too few',
      targets: 'entry 1, value: none',
    })
  })
})

describe('a calibration', () => {
  const recording = (id: string) =>
    ({
      id,
      controller: 'pi',
      design: { P: 0.4 },
      walk: { name: 'fast' },
      mean_current: 0.123456,
      peak_current: 0.9,
    }) as unknown as RecordingView

  test('has a walk and currents per recording, and no targets of deselected recordings', () => {
    const [a, b] = [recording('aa'), recording('bb')]
    const targets = withRecordings([], [], [a, b])
    const { walks, targets: sent } = calibrationSpec(
      EMPTY_FIT,
      ALL,
      targets,
      'szabadka2',
      [b],
      METHODS,
    )
    expect(walks).toEqual([
      { name: 'walk-1', controller: 'pi', design: { P: 0.4 }, scenarios: [{ name: 'fast' }] },
    ])
    expect(sent).toEqual([
      { walk: 'walk-1', quantity: 'mean_current', value: 0.1235, tolerance: 0.1, use: 'fit' },
      { walk: 'walk-1', quantity: 'peak_current', value: 0.9, tolerance: 0.2, use: 'predict' },
    ])
  })

  test('keeps edited and removed targets when another recording is added', () => {
    const [a, b] = [recording('aa'), recording('bb')]
    const remaining = withRecordings([], [], [a]).slice(0, 1)
    const targets = withRecordings(remaining, ['aa'], [a, b])
    expect(targets.map(({ recording }) => recording)).toEqual(['aa', 'bb', 'bb'])
    expect(new Set(targets.map(({ key }) => key)).size).toBe(3)
    expect(nextKey(targets)).toBe(3)
  })
})

describe('a measured walk', () => {
  const draft = { ...emptyWalk(CATALOGUE), design: '{"P": 0.4}' }

  test('names its preset, unless the cycles differ', () => {
    const { name } = CATALOGUE.scenarios[0]
    const request = measuredRequest(draft, 'szabadka2', 'time [s]', CATALOGUE)
    expect(request).toMatchObject({ robot: 'szabadka2', scenario: name, design: { P: 0.4 } })
    const walked = measuredRequest({ ...draft, cycles: '5' }, 'szabadka2', '', CATALOGUE)
    expect(walked.scenario).toMatchObject({ name, cycles: 5 })
  })

  test('sends an invalid design as typed, for the API to reject', () => {
    expect(measuredRequest({ ...draft, design: '{' }, 'szabadka2', '', CATALOGUE).design).toBe('{')
  })

  test('assigns API errors to its fields', () => {
    const errors = [
      { field: 'log', message: 'line 3: not a number' },
      { field: 'scenario.cycles', message: 'must be a number' },
      { field: 'design.P', message: 'missing' },
      { field: '', message: 'no' },
    ]
    expect(walkErrors(errors)).toEqual({
      log: 'line 3: not a number',
      cycles: 'must be a number',
      design: 'P: missing',
      '': 'no',
    })
  })
})
