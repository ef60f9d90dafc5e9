/** Form draft of a plug-in case: its name, and its settings as text. */

import type { PluginCase } from '../../api/types'
import { fieldsIn, type ObjectSchema, type SchemaField } from '../fields/schema-fields'
import { type OptimizerDraft, settingText, settingTexts } from './optimizer'

/** null for gaitswarm's simulator. */
export type CaseDraft = OptimizerDraft | null

export function caseFields(entry: PluginCase | undefined): readonly SchemaField[] {
  if (!entry) return []
  return [...fieldsIn(entry.settings_schema as ObjectSchema).values()].filter(
    ({ name }) => name !== 'name',
  )
}

/** A case with its default settings, overridden by a spec's. */
export function caseDraft(entry: PluginCase | undefined, overrides: object = {}): CaseDraft {
  if (!entry) return null
  const defaults = caseFields(entry).map((field) => [field.name, settingText(field.default)])
  return { ...Object.fromEntries(defaults), ...settingTexts(overrides), name: entry.name }
}

/** Draft of a spec's case, given by name or settings; null also if the case is unknown. */
export function caseOf(requested: unknown, cases: readonly PluginCase[]): CaseDraft {
  if (typeof requested === 'string') return caseDraft(cases.find(({ name }) => name === requested))
  if (typeof requested !== 'object' || requested === null || !('name' in requested)) return null
  return caseDraft(
    cases.find(({ name }) => name === requested.name),
    requested,
  )
}
