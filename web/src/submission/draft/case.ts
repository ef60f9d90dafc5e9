/** A plug-in's case as the form has it: its name and its settings as text. */

import type { PluginCase } from '../../api/types'
import { fieldsIn, type ObjectSchema, type SchemaField } from '../fields/schema-fields'
import { type OptimizerDraft, settingText, settingTexts } from './optimizer'

/** null for a walk in gaitswarm's own simulator. */
export type CaseDraft = OptimizerDraft | null

/** What can be set of a case; its name is chosen, not set. */
export function caseFields(entry: PluginCase | undefined): readonly SchemaField[] {
  if (!entry) return []
  return [...fieldsIn(entry.settings_schema as ObjectSchema).values()].filter(
    ({ name }) => name !== 'name',
  )
}

/** A case with its default settings, and those that a spec gives it. */
export function caseDraft(entry: PluginCase | undefined, given: object = {}): CaseDraft {
  if (!entry) return null
  const usual = caseFields(entry).map((field) => [field.name, settingText(field.default)])
  return { ...Object.fromEntries(usual), ...settingTexts(given), name: entry.name }
}

/** The draft of a spec's case, a name or settings; null too for one that is not known here. */
export function caseOf(asked: unknown, cases: readonly PluginCase[]): CaseDraft {
  if (typeof asked === 'string') return caseDraft(cases.find(({ name }) => name === asked))
  if (typeof asked !== 'object' || asked === null || !('name' in asked)) return null
  return caseDraft(
    cases.find(({ name }) => name === asked.name),
    asked,
  )
}
