import { type Draft, emptyDraft, scenarioDraft } from '../../../src/submission/draft/draft'
import { CATALOGUE } from '../catalogue-example'

export const EMPTY = emptyDraft(CATALOGUE)

export const withCustomScenario: Draft = {
  ...EMPTY,
  presets: ['fast'],
  custom: [scenarioDraft(CATALOGUE.fields.scenario, CATALOGUE.scenarios[1], 'mine')],
}
