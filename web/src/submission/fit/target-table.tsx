/** Targets of walks without a log: a table, typed or from a file. */

import { useEffect, useMemo, useState } from 'preact/hooks'
import { useResource } from '../../api/resource'
import { Card } from '../../components/card'
import { FileField, TextField } from '../../components/fields/field'
import { DesignPicker } from '../../walk/design/design-picker'
import { DEFAULT_SOURCE, type DesignSource, wordOf } from '../../walk/design/design-source'
import { resolveDesign } from '../../walk/design/resolve-design'
import { type TableWalk, tableWalks } from './targets'

export function TargetTable({ onWalks }: { onWalks: (walks: readonly TableWalk[]) => void }) {
  const [source, setSource] = useState<DesignSource>(DEFAULT_SOURCE)
  const [text, setText] = useState('')
  const { data } = useResource(wordOf(source), (signal) => resolveDesign(source, signal))
  const { walks, problem } = useMemo(() => {
    if (data === null) return { walks: [], problem: undefined }
    return tableWalks(text, {
      controller: data.controller.name,
      design: { ...data.design } as TableWalk['design'],
    })
  }, [text, data])
  useEffect(() => onWalks(walks), [walks])
  return (
    <Card class="stack" title="Targets of a table" note="Figures of walks that have no log.">
      <div class="fields">
        <DesignPicker
          label="Design that walked"
          chosen={data?.source ?? source}
          chosenLabel={data?.label ?? 'This design'}
          onChoose={(chosen) => chosen && setSource(chosen)}
        />
        <FileField
          label="Table"
          accept=".csv,.tsv,text/csv"
          hint="CSV, chosen or dropped"
          onFile={(file) => file?.text().then(setText)}
        />
      </div>
      <TextField
        wide
        label="Targets, one per line"
        rows={5}
        spellcheck={false}
        placeholder="normal-fast, speed, 0.047, 0.05, fit"
        hint="scenario, quantity, value, relative tolerance (0.1 if empty), fit or predict"
        value={text}
        error={problem}
        onChange={setText}
      />
    </Card>
  )
}
