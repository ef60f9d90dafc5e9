/** Search methods as the form has them: settings as text, with the defaults of their method. */

import type { OptimizerPreset } from '../../api/types'
import { fieldsIn, type ObjectSchema, type SchemaField } from '../fields/schema-fields'

export type OptimizerDraft = Readonly<Record<string, string>>

/** The entry that stands for a method with its default settings; its name is the method's. */
export function methodNamed(
  optimizers: readonly OptimizerPreset[],
  name: string | undefined,
): OptimizerPreset | undefined {
  return optimizers.find((entry) => entry.name === name && entry.settings.name === name)
}

/** Every method by its default settings, without further presets. */
export function methodsOf(optimizers: readonly OptimizerPreset[]): readonly OptimizerPreset[] {
  return optimizers.filter(({ name, settings }) => name === settings.name)
}

/** All entries of one method: its default settings, then further presets. */
export function presetsOf(
  optimizers: readonly OptimizerPreset[],
  method: string,
): readonly OptimizerPreset[] {
  return optimizers.filter(({ settings }) => settings.name === method)
}

/** What can be set of a method, in the order of its schema; its name is chosen, not set. */
export function settingsOf(entry: OptimizerPreset | undefined): readonly SchemaField[] {
  if (!entry) return []
  return [...fieldsIn(entry.settings_schema as ObjectSchema).values()].filter(
    ({ name }) => name !== 'name',
  )
}

/** An optimizer with a preset's settings; how many designs an iteration has, presets leave open. */
export function withPreset(
  optimizer: OptimizerDraft,
  { settings }: OptimizerPreset,
): OptimizerDraft {
  return { ...settingTexts(settings), particles: optimizer.particles }
}

/** Settings of a spec as the form has them; what it leaves out has the method's default. */
export function optimizerDraft(
  optimizers: readonly OptimizerPreset[],
  asked: string | object | undefined,
  usual: string,
): OptimizerDraft {
  if (typeof asked === 'string') {
    const found = optimizers.find(({ name }) => name === asked)
    return settingTexts(found?.settings ?? { name: asked })
  }
  const given = settingTexts(asked ?? {})
  const method = methodNamed(optimizers, given.name ?? usual)
  return { ...settingTexts(method?.settings ?? {}), ...given }
}

/** The settings that a spec has for a draft; what was left empty has the default. */
export function optimizerSettings(optimizer: OptimizerDraft): Record<string, unknown> {
  const given = Object.entries(optimizer).filter(([, text]) => text.trim() !== '')
  return Object.fromEntries(given.map(([name, text]) => [name, settingValue(text)]))
}

export function settingTexts(settings: object): OptimizerDraft {
  return Object.fromEntries(Object.entries(settings).map(([name, v]) => [name, settingText(v)]))
}

export function settingText(value: unknown): string {
  if (value === undefined || value === null) return ''
  return typeof value === 'object' ? JSON.stringify(value) : String(value)
}

/** What is neither a number, a truth value nor a list is left as it was written. */
function settingValue(text: string): unknown {
  if (text === 'true' || text === 'false') return text === 'true'
  const number = Number(text)
  if (!Number.isNaN(number)) return number
  try {
    return /^\s*[[{]/.test(text) ? JSON.parse(text) : text
  } catch {
    return text
  }
}
