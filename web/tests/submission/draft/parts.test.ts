import { describe, expect, test } from 'vitest'
import type { JobSpec, Variable } from '../../../src/api/types'
import { specOf } from '../../../src/submission/draft/build-spec'
import { type Draft, draftOf, withSearch } from '../../../src/submission/draft/draft'
import {
  caseDraft,
  constraintsOf,
  constraintsText,
  hasEffect,
  settingsOf,
  walksEach,
  worldsFields,
} from '../../../src/submission/draft/settings'
import { boundsInWords, fieldsOf } from '../../../src/submission/fields/schema-fields'
import { ofKind, withRobotJob } from '../../../src/submission/robot/job'
import { CATALOGUE, DOCUMENT } from '../catalogue-example'
import { EMPTY } from './drafts'

describe('worlds', () => {
  const { fields } = CATALOGUE
  const robust = (values: Record<string, string> = {}): Draft => ({
    ...EMPTY,
    worlds: { ...EMPTY.worlds, robust: true, values: { ...EMPTY.worlds.values, ...values } },
  })

  test('are omitted unless the job is robust', () => {
    expect(specOf(EMPTY)).not.toHaveProperty('worlds')
    expect(walksEach(EMPTY.worlds)).toBe(1)
    expect(specOf(robust()).worlds).toEqual({ count: 8, seed: 1, aggregate: 'cvar', level: 0.75 })
  })

  test('have the fields of the schema, in its order', () => {
    const names = worldsFields(fields.worlds).map(({ name }) => name)
    expect(names).toEqual(['count', 'seed', 'aggregate', 'level'])
  })

  test('multiply the simulations of a design', () => {
    expect(walksEach(robust({ count: '12' }).worlds)).toBe(12)
    expect(walksEach(robust({ count: 'many' }).worlds)).toBeNaN()
    expect(specOf(robust({ count: 'many' })).worlds).toMatchObject({ count: 'many' })
    expect(specOf(robust({ count: '' })).worlds).toMatchObject({ count: '' })
  })

  test('have a level for quantile and cvar only', () => {
    const level = fields.worlds.get('level')!
    const hasLevel = (aggregate: string) => hasEffect(level, robust({ aggregate }).worlds)
    expect(['mean', 'quantile', 'worst', 'cvar'].filter(hasLevel)).toEqual(['quantile', 'cvar'])
  })

  test('of a cloned job are sent with their ranges', () => {
    const worlds = {
      count: 3,
      seed: 5,
      aggregate: 'worst',
      level: 0.5,
      ranges: ['friction_factor'],
    }
    const cloned = draftOf({ worlds } as unknown as JobSpec, CATALOGUE)
    expect(specOf(cloned).worlds).toEqual(worlds)
    const all = { ...cloned, worlds: { ...cloned.worlds, ranges: null } }
    expect(specOf(all).worlds).not.toHaveProperty('ranges')
  })
})

describe('settings of a robot folder', () => {
  const files: Draft = { ...EMPTY, name: 'mine', ...ofKind(EMPTY, 'files', CATALOGUE) }
  const slow = { name: 'slow', cycle_time: 2 }

  test('replace scenarios and variables of the shipped robot', () => {
    expect(specOf(files).scenarios).toEqual([])
    const job = JSON.stringify({
      controller: 'pi',
      scenarios: [slow],
      variables: [{ name: 'P', low: 1, high: 2 }],
      fixed: { FOMF: 2 },
    })
    const spec = specOf(withRobotJob(files, CATALOGUE, job))
    expect(spec).toMatchObject({ name: 'mine', robot: { toml: '', urdf: '' }, scenarios: [slow] })
    expect(spec.variables).toEqual([{ name: 'P', low: 1, high: 2 }])
    expect(spec.fixed).toEqual({ FOMF: 2 })
    expect(spec.iterations).toBe(25)
  })

  test('are discarded when a shipped robot is chosen', () => {
    const back = { ...files, ...ofKind(files, 'shipped', CATALOGUE) }
    expect(specOf(back)).toEqual(specOf({ ...EMPTY, name: 'mine' }))
  })

  test.each([
    ['{', /not valid JSON/],
    ['[]', /one JSON object/],
    ['{"controller": "none"}', /controller none/],
  ])('rejects %s', (text, message) => {
    expect(() => withRobotJob(files, CATALOGUE, text)).toThrow(message)
  })
})

test('a plug-in case is chosen with its settings, and recognized in a spec', () => {
  const [damped] = CATALOGUE.cases
  expect(settingsOf(damped).map(({ name }) => name)).toEqual(['share'])
  const spec = specOf({ ...EMPTY, case: { ...caseDraft(damped), share: '0.3' } })
  expect(spec.case).toEqual({ name: 'damped', share: 0.3 })
  expect(specOf(draftOf(spec, CATALOGUE)).case).toEqual({ name: 'damped', share: 0.3 })
  const named = draftOf({ case: 'damped' } as unknown as JobSpec, CATALOGUE)
  expect(specOf(named).case).toEqual({ name: 'damped', share: 0.1 })
  expect(specOf(EMPTY)).not.toHaveProperty('case')
})

describe('fields of the schema', () => {
  const scenario = fieldsOf(DOCUMENT, 'Scenario')

  test('have a unit, bounds and a default', () => {
    expect(scenario.get('radius')).toMatchObject({ unit: 'm', low: 0, high: 1, required: true })
    expect(scenario.get('load')).toMatchObject({ unit: '1', default: 0, required: false })
  })

  test('describe their bounds', () => {
    expect(boundsInWords(scenario.get('radius')!)).toBe('above 0, at most 1')
    expect(boundsInWords(scenario.get('load')!)).toBe('0 to 50')
    expect(boundsInWords(fieldsOf(DOCUMENT, 'JobSpec').get('seed')!)).toBe('at least 0')
  })

  test('of a missing schema are an error', () => {
    expect(() => fieldsOf(DOCUMENT, 'Nothing')).toThrow('no schema Nothing')
  })
})

test('scenarios have weights in the mean, or the worst one counts', () => {
  expect(specOf(EMPTY)).not.toHaveProperty('scenario_weights')
  const weighed = { ...EMPTY, weights: { fast: '2', loaded: ' 1 ', gone: '3' } }
  expect(specOf(weighed)).toMatchObject({ scenario_weights: { fast: 2 } })
  expect(specOf(draftOf(specOf(weighed), CATALOGUE))).toEqual(specOf(weighed))
  const wrong = { ...EMPTY, weights: { fast: 'twice' } }
  expect(specOf(wrong).scenario_weights).toEqual({ fast: 'twice' })
  const worst = specOf({ ...weighed, aggregate: 'worst' })
  expect(worst.scenario_aggregate).toBe('worst')
  expect(worst).not.toHaveProperty('scenario_weights')
  expect(draftOf(worst, CATALOGUE).aggregate).toBe('worst')
})

describe('the default job', () => {
  const gait = { name: 'stride', low: 0.06, high: 0.2 }

  test('searches controller and gait, no worse than the published design, in its gait', () => {
    expect(specOf(EMPTY).constraints).toEqual(['*<=published:A'])
    expect(specOf(EMPTY).variables).toContainEqual(gait)
  })

  test('searches the controller alone where no design was published', () => {
    const own = specOf({ ...EMPTY, ...ofKind(EMPTY, 'files', CATALOGUE) })
    expect(own).not.toHaveProperty('constraints')
    expect(own.variables?.map((entry) => (entry as Variable).name)).toEqual(['P', 'FOMF'])
    const [pi] = CATALOGUE.controllers
    const controllers = [pi, { ...pi, name: 'pid', published: {} }]
    const catalogue = { ...CATALOGUE, controllers }
    const other = { ...EMPTY, ...withSearch(EMPTY, catalogue, { controller: 'pid' }) }
    expect(specOf(other)).not.toHaveProperty('constraints')
    expect(specOf(other).controller).toBe('pid')
    const edited = withSearch({ ...EMPTY, constraints: 'speed>=1' }, catalogue, {
      controller: 'pid',
    })
    expect(edited.constraints).toBe('speed>=1')
  })
})

describe('constraints', () => {
  test('are lines of text, or JSON where they are relative to a design', () => {
    const relative = { quantity: '*', relative_to: { P: 0.45 }, max: 1 }
    const text = [
      'slope-fast:speed>=0.03',
      'energy<=0.9*published:A',
      'speed>=1*job:abc',
      JSON.stringify(relative),
    ].join('\n')
    const constraints = [
      { quantity: 'speed', scenario: 'slope-fast', min: 0.03, max: null },
      { quantity: 'energy', scenario: '*', max: 0.9, relative_to: 'published:A' },
      { quantity: 'speed', scenario: '*', min: 1, relative_to: 'abc' },
      { ...relative, reference: { walk: { speed: 1 } } },
    ] as never
    expect(constraintsText(constraints)).toBe(text)
    expect(constraintsOf(` ${text}\n\n`)).toEqual([...text.split('\n').slice(0, 3), relative])
    expect(constraintsOf('{"quantity"')).toEqual(['{"quantity"'])
  })
})
