/** Choice of a design: published ones, and the best ones of jobs. */

import { get } from '../../api/client'
import { jobSearch } from '../../api/jobs'
import { useResource } from '../../api/resource'
import { type ChoiceGroup, Combobox } from '../../components/fields/combobox'
import { type DesignSource, sourceOfWord, wordOf } from './design-source'

interface DesignPickerProps {
  label: string
  chosen: DesignSource | null
  chosenLabel: string
  /** Label of choosing no design; required choice if missing. */
  none?: string
  /** Why published designs are not offered; they are if missing. */
  note?: string
  onChoose: (source: DesignSource | null) => void
}

export function DesignPicker(props: DesignPickerProps) {
  const { label, chosen, chosenLabel, none, note, onChoose } = props
  const controllers = useResource('controllers', (signal) => get('/v1/controllers', { signal }))
  const published = (controllers.data?.items ?? []).flatMap((controller) =>
    Object.keys(controller.published).map((study) => ({
      value: wordOf({ controller: controller.name, published: study }),
      label: `${controller.name}: ${study}`,
    })),
  )
  const groups: ChoiceGroup[] = []
  if (none !== undefined) groups.push({ label: '', choices: [{ value: '', label: none }] })
  if (note === undefined) groups.push({ label: 'Published designs', choices: published })
  const word = chosen ? wordOf(chosen) : ''
  const publishedLabel = published.find(({ value }) => value === word)?.label
  return (
    <Combobox
      label={label}
      selected={chosen ? (publishedLabel ?? chosenLabel) : (none ?? '')}
      hint={note}
      groups={groups}
      remote={{ label: 'Best of a job', search: bestOfJobs }}
      onChoose={(value) => onChoose(sourceOfWord(value))}
    />
  )
}

const bestOfJobs = jobSearch('tuning', { value: (job) => wordOf({ job }) })
