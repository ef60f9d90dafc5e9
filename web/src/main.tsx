import { render } from 'preact'
import { App } from './app'
import { followLinks } from './router/navigation'
import './styles/index.css'
import { startTheme } from './theme'

startTheme()
followLinks()
render(<App />, document.getElementById('page')!)
